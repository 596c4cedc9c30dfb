"""The README is a front page: short, and its snippet runs as it stands."""

from __future__ import annotations

from pathlib import Path

import pytest
from pages import blocks, run_python

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
SNIPPETS = [code for language, code in blocks(README) if language == "python"]
WORDS = 1000
"""Greatest number of words of the README."""


def test_the_snippet_steps_an_environment_generates_a_layout_and_evaluates_a_policy(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {"__name__": "__main__"}
    run_python(SNIPPETS[0], tmp_path, names)
    assert names["env"].observation_space.contains(names["observation"])
    assert names["info"]["time"] == pytest.approx(0.1)
    success, spl = (float(word) for word in capsys.readouterr().out.split()[-2:])
    assert 0.0 < spl <= success == 1.0
    assert len(names["report"].rows) == len((tmp_path / "runs/astar/episodes.jsonl").read_text().splitlines()) > 0


def test_the_site_s_landing_page_begins_with_the_same_environment():
    shown = [code for _, code in blocks((ROOT / "docs" / "index.md").read_text(encoding="utf-8"))]
    assert len(shown) == 1
    assert set(shown[0].splitlines()) <= set(SNIPPETS[0].splitlines())


def test_the_front_page_is_short():
    assert len(README.split()) <= WORDS
    assert len(SNIPPETS) == 1
    assert len([line for line in SNIPPETS[0].splitlines() if line.strip()]) <= 10
