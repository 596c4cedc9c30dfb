from __future__ import annotations

import inspect
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from labgym.cli import main
from labgym.cli.arguments import parse_options
from labgym.errors import OptionError
from labgym.eval.driving.drive import drive_layout
from labgym.layouts import load_published, published
from labgym.policies.adapters.inputs import SHAPES
from labgym.policies.http.client import HttpPolicy
from labgym.policies.registry import policy_table
from labgym.suites import Suite

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE, NAVDP = ((DOCS / name).read_text(encoding="utf-8") for name in ("policies.md", "navdp.md"))


def test_the_pages_policy_drives():
    names: dict[str, object] = {}
    exec(re.search(r"```python\n(.*?)```", PAGE, re.DOTALL)[1], names)
    layout = load_published("test", published("test")[0])
    for drive in drive_layout(names["Careful"](), layout, Suite(name="brief", max_steps=10), "careful", 0):
        assert drive.row.error is None
        assert drive.row.steps == 10
        assert drive.row.path_length > 0.0


def test_the_pages_inputs_are_those_that_networks_are_fed():
    rows = dict(re.findall(r"^\| `(\w+)` \| (1 x [\dx ]+?) \|", PAGE, re.MULTILINE))
    assert rows == {name: " x ".join(map(str, shape)) for name, shape in SHAPES.items()}


def test_the_pages_defaults_are_those_of_the_client():
    defaults = {name: part.default for name, part in inspect.signature(HttpPolicy).parameters.items()}
    for name in ("replan", "step_timeout", "reset_timeout", "retries", "approach"):
        assert f"`{name}` ({defaults[name]:g})" in NAVDP
    assert all(f"`{name}`" in PAGE for name in defaults if name != "url")


def test_options_are_read_as_json_or_else_as_text():
    texts = ["replan=2", "trust=true", "url=http://x/?a=b", 'inputs={"scan": "lidar"}', "empty=", "none=null"]
    assert parse_options(texts) == {
        "replan": 2,
        "trust": True,
        "url": "http://x/?a=b",
        "inputs": {"scan": "lidar"},
        "empty": "",
        "none": None,
    }


@pytest.mark.parametrize("text", ["replan", "=2", "two words=2", ""])
def test_an_option_without_a_name_is_refused(text):
    with pytest.raises(OptionError, match="NAME=VALUE"):
        parse_options([text])


def test_an_evaluation_takes_options_and_names_its_folder_after_the_policy(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    layout = published("test")[0]
    url = "http://127.0.0.1:1"
    arguments = ["--layouts", layout, "--options", "retries=0", "backoff=0.0"]
    assert main(["eval", "--policy", url, *arguments]) == 1
    assert f"the policy failed in 6 episodes, first in {layout}/0/0: " in capsys.readouterr().err
    folder = tmp_path / "runs" / "http_127.0.0.1_1-layouts"
    rows = (folder / "episodes.jsonl").read_text().splitlines()
    assert rows
    assert all("no connection" in row for row in rows)


def test_a_class_is_reported_by_the_name_that_it_gives_itself(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a_named_policy.py").write_text(
        "import numpy as np\nfrom labgym.policies import Policy\n"
        "class GoToGoal(Policy):\n    name = 'go-to-goal'\n    def reset(self, episode): pass\n"
        "    def act(self, observation): return np.zeros(2)\n"
    )
    layout = published("test")[0]
    assert main(["eval", "--policy", "a_named_policy:GoToGoal", "--layouts", layout, "--out", "out"]) == 0
    assert "go-to-goal" in capsys.readouterr().out
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["policy"] == "go-to-goal"
    assert all(json.loads(row)["policy"] == "go-to-goal" for row in (tmp_path / "out" / "episodes.jsonl").open())


def test_an_error_of_a_policy_is_printed_with_its_line_once(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a_failing_policy.py").write_text(
        "from labgym.policies import Policy\n\n\nclass Failing(Policy):\n    def reset(self, episode): pass\n"
        "    def act(self, observation):\n        return observation['radar']\n"
    )
    layout = published("test")[0]
    command = [sys.executable, "-m", "labgym.cli", "eval", "--policy", "a_failing_policy:Failing", "--layouts", layout]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert ended.returncode == 1
    assert ended.stderr.count("Traceback") == 1
    assert re.search(r'a_failing_policy.py", line 7, in act\n.*\n(.*\^\n)?KeyError: .radar.', ended.stderr)
    assert f"the policy failed in 6 episodes, first in {layout}/0/0: KeyError: 'radar'" in ended.stderr


def test_the_command_lists_the_policies_and_what_they_need(capsys):
    assert main(["policies"]) == 0
    text = capsys.readouterr().out
    assert main(["eval", "--policy", "?"]) == 0
    assert capsys.readouterr().out == text
    assert text == policy_table() + "\n"
