"""report.md with its tables, plots and contact sheets."""

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

from . import metrics, store  # noqa: E402

# One colour per technique everywhere (Tol's muted scheme, told apart by colour-blind readers); ours is black.
COLORS = {
    "raytrace": "#bbbbbb", "pathtrace": "#88ccee", "bpt": "#332288", "restir": "#ddcc77", "ddgi": "#117733",
    "ddgi_restir": "#44aa99", "restir_bpt": "#aa4499", "ddgi_restir_bpt": "#cc6677", "hybrid": "#000000",
    "reference": "#999933", "mitsuba": "#ff8800", "cycles": "#ddaa00", "hybrid_final": "#777777",
}
plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
                     "grid.alpha": 0.25, "axes.axisbelow": True, "legend.frameon": False})


def color(name):
    return COLORS.get(name, "#666666")


class Page:
    """A Markdown page under construction in `folder`."""

    def __init__(self, folder, title):
        self.folder, self.lines = Path(folder), [f"# {title}", ""]

    def text(self, text):
        self.lines += [text, ""]

    def heading(self, text):
        self.text(f"## {text}")

    def table(self, header, rows):
        self.lines += ["| " + " | ".join(map(str, row)) + " |" for row in (header, ["---"] * len(header), *rows)] + [""]

    def targets(self, rows):
        """rows: (what, target, measured, met); met None: not measured, or not told apart from noise."""
        self.heading("Targets")
        words = {True: "met", False: "**missed**", None: "undecided"}
        self.table(("what", "target", "measured", ""), [(*row[:3], words[row[3]]) for row in rows])

    def plot(self, figure, name, caption):
        """Writes NAME.png and NAME.svg."""
        for suffix, dpi in (("svg", 72), ("png", 120)):
            figure.savefig(self.folder / f"{name}.{suffix}", dpi=dpi, bbox_inches="tight")
        plt.close(figure)
        self.text(f"![{name}]({name}.png)")
        self.text(f"*{caption}*")

    def write(self):
        store.write_text(self.folder / "report.md", "\n".join(self.lines).rstrip() + "\n")


def number(value, digits=3):
    """Short text of a measured value."""
    return "" if value is None else f"{value:.{digits}g}"


def within(found, bound):
    """Whether a bias, given with the width of its interval, is within `bound`; None where noise leaves that open."""
    value, width = found
    if abs(value) - width > bound:
        return False
    return True if abs(value) <= bound and width <= bound else None


def worst(found, bound):
    """(text, verdict) of biases by name: the one that speaks most against all of them being within `bound`."""
    def against(name):
        return {False: 2, None: 1, True: 0}[within(found[name], bound)], abs(found[name][0])

    name = max(found, key=against)
    return f"{percents(found[name])} ({name})", within(found[name], bound)


def percent(value, digits=2):
    return f"{100 * value:.{digits}f}%"


def percents(found, digits=2):
    """Of a bias with its interval."""
    return f"{100 * found[0]:+.{digits}f} +- {100 * found[1]:.{digits}f}%"


def grouped_bars(groups, series, values, ylabel, log=False, lines=()):
    """values[name][group]; None leaves a gap. lines: (y, text) across the plot."""
    figure, axes = plt.subplots(figsize=(max(6, 0.3 * len(groups) * len(series) + 2), 3.4))
    width = 0.8 / len(series)
    for index, name in enumerate(series):
        heights = [values[name].get(group) or np.nan for group in groups]
        axes.bar(np.arange(len(groups)) + (index - (len(series) - 1) / 2) * width, heights, width, label=name,
                 color=color(name))
    for y, text in lines:
        axes.axhline(y, color="#cc3311", linewidth=1, linestyle="--")
        axes.annotate(text, (1, y), xycoords=("axes fraction", "data"), ha="right", va="bottom", color="#cc3311")
    axes.set_xticks(range(len(groups)), groups)
    axes.set_ylabel(ylabel)
    if log:
        axes.set_yscale("log")
    axes.legend(ncols=min(5, len(series)), loc="lower left", bbox_to_anchor=(0, 1.0))
    return figure


def lines_by_group(groups, series, values, ylabel, marks=()):
    """The paper's figure 5: one line per name over scenes, logarithmic."""
    figure, axes = plt.subplots(figsize=(max(6, 1.2 * len(groups)), 3.8))
    for name in series:
        axes.plot(groups, [values[name].get(group, np.nan) for group in groups], marker="o", markersize=4, label=name,
                  color=color(name), linewidth=2 if name == "hybrid" else 1.3)
    for y, text in marks:
        axes.axhline(y, color="#cc3311", linewidth=1, linestyle="--")
        axes.annotate(text, (1, y), xycoords=("axes fraction", "data"), ha="right", va="bottom", color="#cc3311")
    axes.set_yscale("log")
    axes.set_ylabel(ylabel)
    axes.tick_params(axis="x", labelrotation=15)
    axes.legend(ncols=4, loc="lower left", bbox_to_anchor=(0, 1.0))
    return figure


def contact_sheet(columns, rows, image, width=2.2):
    """A grid of linear pictures, image(row, column) or None for an empty cell; shown with plain clipping."""
    example = next(p for r in rows for c in columns if (p := image(r, c)) is not None)
    height = width * example.shape[0] / example.shape[1]
    figure, grid = plt.subplots(len(rows), len(columns), squeeze=False,
                                figsize=(width * len(columns) + 0.3, (height + 0.05) * len(rows) + 0.3))
    for r, row in enumerate(rows):
        for c, column in enumerate(columns):
            axes, picture = grid[r][c], image(row, column)
            axes.set_xticks([])
            axes.set_yticks([])
            axes.grid(False)
            for spine in axes.spines.values():
                spine.set_visible(False)
            if picture is not None:
                axes.imshow(picture if picture.dtype == np.uint8 else metrics.to_display(picture), interpolation="nearest")
            if r == 0:
                axes.set_title(column, fontsize=9)
            if c == 0:
                axes.set_ylabel(row, fontsize=8, rotation=0, ha="right", va="center")
    figure.subplots_adjust(wspace=0.03, hspace=0.05)
    return figure
