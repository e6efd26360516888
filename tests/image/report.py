"""A page of the pictures that differ from their references: build/test-report/index.html."""

import html
import shutil

import harness
from trilume_bench import metrics

FOLDER = harness.BUILD / "test-report"
SHOWN_WIDTH = 384

PAGE = """<!doctype html>
<meta charset="utf-8">
<title>Trilume: differences</title>
<style>
body {{ font: 15px/1.5 sans-serif; margin: 2em; background: #222; color: #ddd }}
figure {{ display: inline-block; margin: 0 1em 1em 0 }}
img {{ image-rendering: pixelated; width: {width}px; display: block }}
</style>
<h1>{count} pictures that differ</h1>
{entries}
"""

ENTRY = """<h2>{title}</h2>
<p>{facts}</p>
<figure><img src="{name}.reference.png" alt=""><figcaption>reference</figcaption></figure>
<figure><img src="{name}.result.png" alt=""><figcaption>result</figcaption></figure>
<figure><img src="{name}.difference.png" alt=""><figcaption>difference: red is too bright, blue too dark; full at 10%</figcaption></figure>
"""


class Report:
    def __init__(self):
        shutil.rmtree(FOLDER, ignore_errors=True)
        self.entries = []

    def add(self, title, image, reference, facts):
        """Writes the three pictures and the page anew, so that it is there even when the run is cut short."""
        FOLDER.mkdir(parents=True, exist_ok=True)
        name = f"{len(self.entries):03d}"
        metrics.write_png(FOLDER / f"{name}.reference.png", metrics.to_display(reference))
        metrics.write_png(FOLDER / f"{name}.result.png", metrics.to_display(image))
        metrics.write_png(FOLDER / f"{name}.difference.png", metrics.difference(image, reference))
        self.entries.append(ENTRY.format(title=html.escape(title), facts=html.escape("; ".join(facts)), name=name))
        page = PAGE.format(width=SHOWN_WIDTH, count=len(self.entries), entries="\n".join(self.entries))
        (FOLDER / "index.html").write_text(page)
