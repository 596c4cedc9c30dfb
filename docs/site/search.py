"""Order of the search results: guides that say most about the words first, then the reference, then the history.

Sphinx gives every page with a word in its text the same score. Here each word also counts by how often a guide has it,
with a heading as ten times, for the length of the guide.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

KEYWORDS = {
    "README": "quickstart, getting started, overview, bibtex, license",
    "docs/classical-policies": "slam, baselines, planner",
    "docs/conditions": "pedestrians, humans, human aware, social navigation, crowd, dynamic obstacles",
    "docs/engineers": "ros2, cad, blueprint, bim, building, excel, spreadsheet",
    "docs/environment": "gym, observation, action, reward, api",
    "docs/faq": "faq, help, headless, problem, error, ros2, mac, wsl, notebook",
    "docs/floors": "buildings",
    "docs/install": "requirements, setup, pip, conda, windows",
    "docs/labnav": "benchmark, rules, challenge",
    "docs/labnav-tasks": "pedestrians, humans",
    "docs/language-models": "llm, gpt, chatgpt",
    "docs/navigation-metrics": "statistics, statistical significance, confidence interval, benchmark metrics",
    "docs/policies": "sandbox, security, agent, model, custom policy",
    "docs/protocols": "chemistry, reaction, synthesis, recipe",
    "docs/robots": "turtlebot, mobile base, mjcf",
    "docs/safety-rules": "face velocity",
    "docs/scale": "cluster, parallel, distributed, hpc",
    "docs/splits": "leakage, held out",
    "docs/training": "sb3, rl, reinforcement learning, hyperparameters",
    "docs/training-data": "offline, demonstrations, imitation",
    "docs/tutorials/train": "quickstart, getting started",
    "docs/viewer": "video, movie, gif, visualization, teleop",
}
"""Words that newcomers use for what a page calls otherwise."""
SHARES = {"docs/api": 0.2, "CHANGELOG": 0.2, "CONTRIBUTING": 0.4, "policies": 0.4, "docs/environments": 0.5}
"""Share of the score that results keep in pages that are no guides, by the beginning of the page's name."""
HEADING = 10
"""Occurrences that a word in a heading counts as."""
WORDS: dict[str, dict[str, float]] = {}
"""How much each guide says about a stem."""
PAGES = 8
"""Guides whose order is kept for each word."""
SCORER = """
const GUIDES = %(guides)s;
const SHARES = %(shares)s;
var Scorer = {
  score: ([page, , , , score]) => {
    const query = new URLSearchParams(window.location.search).get("q") || "";
    const share = Object.keys(SHARES).find((start) => page.startsWith(start));
    const terms = [...Search._parseQuery(query)[1]];
    const rank = (term) => (Object.hasOwn(GUIDES, term) ? GUIDES[term][page] || 0 : 0);
    return score * (share ? SHARES[share] : 1) + terms.reduce((sum, term) => sum + rank(term), 0);
  },
  objNameMatch: 11, objPartialMatch: 6, objPrio: {0: 15, 1: 5, 2: -5}, objPrioDefault: 0,
  title: 15, partialTitle: 7, term: 5, partialTerm: 2,
};
"""


def add_keywords(app: Sphinx, doctree: nodes.document) -> None:
    """Add the keywords of a page to its head, which the index reads, too."""
    if words := KEYWORDS.get(app.env.docname):
        doctree.insert(0, nodes.meta("", name="keywords", content=words))


def count_words(app: Sphinx, doctree: nodes.document, docname: str) -> None:
    """Count the stems in a guide."""
    if app.builder.format != "html" or docname.startswith(tuple(SHARES)):
        return
    language = app.builder.indexer.lang  # type: ignore[attr-defined]
    counts: Counter[str] = Counter()
    texts = [(doctree.astext(), 1), *((title.astext(), HEADING) for title in doctree.findall(nodes.title))]
    for text, weight in [*texts, (KEYWORDS.get(docname, ""), HEADING)]:
        for word in language.split(text):
            counts[language.stem(word).lower()] += weight
    length = sum(counts.values())
    WORDS[docname] = {stem: math.log1p(count) / length**0.1 for stem, count in counts.items()}


def write_scorer(app: Sphinx, exception: Exception | None) -> None:
    """Give the search the guides of each stem, the first ones with the greatest bonus."""
    if exception is not None or app.builder.format != "html":
        return
    stems: dict[str, list[tuple[float, str]]] = {}
    for page, words in sorted(WORDS.items()):
        for stem, weight in words.items():
            stems.setdefault(stem, []).append((-weight, page))
    guides = {
        stem: {page: 3 * (PAGES - place) for place, (_, page) in enumerate(sorted(pages)[:PAGES])}
        for stem, pages in sorted(stems.items())
    }
    code = SCORER % {"guides": json.dumps(guides, separators=(",", ":")), "shares": json.dumps(SHARES)}
    with (Path(app.outdir) / "_static" / "language_data.js").open("a", encoding="utf-8") as file:
        file.write(code)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the extension."""
    app.connect("doctree-read", add_keywords)
    app.connect("doctree-resolved", count_words)
    app.connect("build-finished", write_scorer)
    return {"parallel_read_safe": True, "parallel_write_safe": False}
