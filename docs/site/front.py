"""The front page of the site: documentation, leaderboard, gallery, model zoo, and one's own runs, in one design."""

from __future__ import annotations

import os
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote

from sphinx.application import Sphinx

LEADERBOARD = "leaderboard/index.html"
"""Page that `labgym leaderboard --out` writes into the site before it is built."""
FILM = "docs/pictures/labnav.webp"
"""The film of the README."""
GALLERY = {
    "suite": "Suite: rooms along a corridor",
    "bay": "Bay: one large room",
    "ell": "Ell: an L-shaped room",
    "double": "Double: two rooms side by side",
    "refit": "Refit: an old building with oblique walls",
    "inside": "The refit of another seed, from its main exit",
}
"""Captions of docs/pictures/gallery_NAME.jpg by name."""
LABNAV = f"""<p><a href="{LEADERBOARD}#leaderboard">Leaderboard</a>: the tasks of LabNav and all published policies.
<a href="{LEADERBOARD}#episodes">Replays</a>: watch 60 episodes in 3D next to their floor plans.</p>
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
<nav aria-label="Site"><ul>{links}
</ul></nav></div></header>
<main class="wide">
<p class="laboratory"><img src="{film}" width="640" height="360"
alt="Film: a robot drives the eight tasks of LabNav in laboratories; its map with people and route, and its camera"></p>
<p>From a protocol, labgym furnishes a laboratory; LabNav measures how well a robot drives in it: past people, through
glass and clutter, to a dock, with a beaker on its deck.
<a href="README.html">Run it in two commands</a>, <a href="docs/tutorials/train.html">train an agent</a>,
<a href="docs/tutorials/evaluate.html">evaluate your policy</a>, <a href="docs/submitting.html">submit a result</a>,
<a href="docs/tutorials/design.html">design a laboratory</a>.</p>
{labnav}<h2 id="runs">Your runs</h2>
<ul>{runs}</ul>
<h2 id="models">Model zoo</h2>
<ul>{models}</ul>
<h2 id="gallery">Gallery of laboratories</h2>
<div class="pictures">{gallery}</div>
<p><a href="docs/floors.html">Floors and their families</a></p>
</main>
</body>
</html>
"""


def front_page(out: Path, runs: Path, titles: dict[str, str], pictures: dict[str, str], film: str) -> str:
    """Return the front page.

    Args:
        out: folder of the site. runs: folder of runs, each with report.html.
        titles: of the site's pages. pictures: addresses and captions of the gallery. film: its address.
    """
    reports = sorted(runs.glob("*/report.html")) if runs.is_dir() else []
    addresses = {path.parent.name: quote(Path(os.path.relpath(path, out)).as_posix()) for path in reports}
    cards = {f"{page}.html": title for page, title in sorted(titles.items()) if page.startswith("policies/")}
    drives = {f"{LEADERBOARD}#leaderboard": "Leaderboard", f"{LEADERBOARD}#episodes": "Replays in 3D"}
    ranked = (out / LEADERBOARD).is_file()
    menu = (drives if ranked else {}) | {"#models": "Models", "#gallery": "Gallery", "docs/index.html": "Documentation"}
    return PAGE.format(
        style=files("labgym.eval.reports").joinpath("templates/site.css").read_text("utf-8"),
        links=_items(menu),
        film=film,
        labnav=LABNAV if ranked else "",
        runs=_items({address: name for name, address in addresses.items()}) or NO_RUNS,
        gallery="".join(FIGURE.format(address, escape(words)) for address, words in pictures.items()),
        models=_items(cards),
    )


def _items(links: dict[str, str]) -> str:
    return "".join(f'<li><a href="{address}">{escape(words)}</a></li>' for address, words in links.items())


def write_front_page(app: Sphinx, exception: Exception | None) -> None:
    """Write the front page after a build without errors."""
    if exception is not None or app.builder.format != "html":
        return
    images = {name: f"_images/{image}" for name, (_, image) in app.env.images.items()}
    pictures = {images[f"docs/pictures/gallery_{name}.jpg"]: words for name, words in GALLERY.items()}
    titles = {page: app.env.titles[page].astext() for page in app.env.found_docs}
    out = Path(app.outdir)
    page = front_page(out, Path(app.srcdir) / "runs", titles, pictures, images[FILM])
    (out / "index.html").write_text(page, "utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Write the front page when a build is finished."""
    app.connect("build-finished", write_front_page)
    return {"parallel_read_safe": True}
