"""The README's snippets run as they stand, with smaller numbers."""

from __future__ import annotations

from pathlib import Path

import pytest
from pages import blocks, run_python, smaller

from labgym.policies import make_policy

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
SNIPPETS = [code for language, code in blocks(README) if language == "python"]

SMALLER = (
    ("total_timesteps=1_000_000", "total_timesteps=8"),
    ("count=64", "count=1"),
    ("layouts=128", "layouts=1"),
    ("n_steps=64, batch_size=1024", "n_steps=8, batch_size=8"),
    ('suite="test"', 'suite=[load_published("test", published("test")[0])]'),
    ("import numpy as np\n", "import numpy as np\nfrom labgym.layouts import load_published, published\n"),
)


def snippet(*words: str) -> str:
    return next(code for code in SNIPPETS if all(word in code for word in words))


def run(code: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, object]:
    monkeypatch.chdir(folder)
    names: dict[str, object] = {"__name__": "__main__"}
    run_python(smaller(code, SMALLER), folder, names)
    return names


def test_every_large_number_is_still_there_to_be_made_smaller():
    assert all(any(large in code for code in SNIPPETS) for large, _ in SMALLER)
    assert len(SNIPPETS) == 3


def test_the_environment_snippet_makes_a_step(tmp_path, monkeypatch):
    names = run(snippet("gym.make"), tmp_path, monkeypatch)
    assert names["env"].observation_space.contains(names["observation"])
    assert names["info"]["time"] == pytest.approx(0.1)


def test_the_site_s_landing_page_shows_the_same_environment_snippet():
    shown = [code for _, code in blocks((ROOT / "docs" / "index.md").read_text(encoding="utf-8"))]
    assert shown == [snippet("gym.make")]


def test_the_training_snippet_trains_and_saves(tmp_path, monkeypatch):
    pytest.importorskip("stable_baselines3")
    names = run(snippet("PPO"), tmp_path, monkeypatch)
    assert names["model"].num_timesteps >= 8
    assert make_policy("ppo-lab.safetensors").observation == "lidar"


def test_the_policy_snippet_is_evaluated(tmp_path, monkeypatch, capsys):
    names = run(snippet("class GoToGoal"), tmp_path, monkeypatch)
    success, spl = (float(word) for word in capsys.readouterr().out.split())
    assert 0.0 <= spl <= success <= 1.0
    assert len(names["report"].rows) == len((tmp_path / "runs/go-to-goal/episodes.jsonl").read_text().splitlines()) > 0


@pytest.mark.parametrize("name", ["sub_01", "rotovap"])
def test_names_in_the_examples_exist(name):
    from labgym.assets import Catalog
    from labgym.protocols import protocols

    assert name in README
    assert name in protocols() or Catalog.load().find(name)


def test_snippets_are_as_short_as_promised():
    lengths = {
        words: len([line for line in snippet(words).splitlines() if line.strip()])
        for words in ("gym.make", "PPO", "GoToGoal")
    }
    assert lengths["gym.make"] <= 5
    assert lengths["PPO"] <= 10
