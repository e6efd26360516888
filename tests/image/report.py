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


def clear():
    shutil.rmtree(FOLDER, ignore_errors=True)


def add(name, title, image, reference, facts):
    """Writes the three pictures and the page anew, so that it is there even when the run is cut short."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    metrics.write_png(FOLDER / f"{name}.reference.png", metrics.to_display(reference))
    metrics.write_png(FOLDER / f"{name}.result.png", metrics.to_display(image))
    metrics.write_png(FOLDER / f"{name}.difference.png", metrics.difference(image, reference))
    entry = ENTRY.format(title=html.escape(title), facts=html.escape("; ".join(facts)), name=name)
    (FOLDER / f"{name}.entry").write_text(entry)
    entries = [file.read_text() for file in sorted(FOLDER.glob("*.entry"))]
    (FOLDER / "index.html").write_text(PAGE.format(width=SHOWN_WIDTH, count=len(entries), entries="\n".join(entries)))
