"""The front page of the site: documentation, leaderboard, gallery, model zoo, and one's own runs, in one design."""

from __future__ import annotations

import os
import re
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote

from sphinx.application import Sphinx

LEADERBOARD = "leaderboard/index.html"
"""Page that `labgym leaderboard --out` writes into the site before it is built."""
DRIVE = "docs/pictures/labnav_people.jpg"
"""Picture of an episode on the front page."""
LABNAV = f"""<h2>LabNav</h2>
<p class="laboratory"><img src="{{drive}}" alt="An episode of the task people: its plan and the robot among people"></p>
<p><a href="{LEADERBOARD}#leaderboard">Leaderboard</a>: eight tasks, all published policies.</p>
<p><a href="{LEADERBOARD}#episodes">Episodes in 3D</a>: 60 drives to replay beside their plan.</p>
"""
NO_RUNS = "<li><code>make run</code> adds one; then build the site again.</li>"
FIGURE = '<figure><img loading="lazy" src="{0}" alt="{1}"><figcaption>{1}</figcaption></figure>'
PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>labgym</title>
<style>
{style}
</style>
</head>
<body>
<header class="top"><div class="wide"><div class="name"><h1>labgym</h1>
<p>Chemistry protocols become laboratories, and laboratories a benchmark of robot navigation</p></div>
<nav aria-label="Site"><ul><li><a href="docs/index.html">Documentation</a></li>
</ul></nav></div></header>
<main class="wide">
{labnav}<h2>Your runs</h2>
<ul>{runs}</ul>
<h2>Gallery of layouts</h2>
<div class="pictures">{gallery}</div>
<p><a href="docs/floors.html">Floors and their families</a></p>
<h2>Model zoo</h2>
<ul>{models}</ul>
</main>
</body>
</html>
"""


def front_page(out: Path, runs: Path, titles: dict[str, str], pictures: dict[str, str], drive: str) -> str:
    """Return the front page.

    Args:
        out: folder of the site. runs: folder of runs, each with report.html.
        titles: of the site's pages. pictures: addresses and captions of the gallery.
    """
    reports = sorted(runs.glob("*/report.html")) if runs.is_dir() else []
    addresses = {path.parent.name: quote(Path(os.path.relpath(path, out)).as_posix()) for path in reports}
    cards = {page: title for page, title in sorted(titles.items()) if page.startswith("policies/")}
    links = [f'<li><a href="{address}">{escape(name)}</a></li>' for name, address in addresses.items()]
    return PAGE.format(
        style=files("labgym.eval.reports").joinpath("templates/site.css").read_text("utf-8"),
        labnav=LABNAV.format(drive=drive) if (out / LEADERBOARD).is_file() else "",
        runs="".join(links) or NO_RUNS,
        gallery="".join(FIGURE.format(address, escape(words)) for address, words in pictures.items()),
        models="".join(f'<li><a href="{page}.html">{escape(title)}</a></li>' for page, title in cards.items()),
    )


def write_front_page(app: Sphinx, exception: Exception | None) -> None:
    """Write the front page after a build without errors."""
    if exception is not None or app.builder.format != "html":
        return
    names = sorted(name for name in app.env.images if re.search(r"/gallery_\w+\.jpg$", name))
    stems = {name: Path(name).stem.removeprefix("gallery_") for name in names}
    pictures = {f"_images/{app.env.images[name][1]}": f"Laboratory: {stems[name]}" for name in names}
    titles = {page: app.env.titles[page].astext() for page in app.env.found_docs}
    out = Path(app.outdir)
    drive = f"_images/{app.env.images[DRIVE][1]}"
    page = front_page(out, Path(app.srcdir) / "runs", titles, pictures, drive)
    (out / "index.html").write_text(page, "utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the front page when a build is finished."""
    app.connect("build-finished", write_front_page)
    return {"parallel_read_safe": True}
