"""A laboratory of the user's own protocol works in every command and in the environment, from its file alone."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import pytest

import labgym.envs  # noqa: F401 - registers the environment
from labgym.cli import main
from labgym.layouts import Layout, load_published
from labgym.navigation import goal_pairs
from labgym.protocols import Protocol, get, protocols

TEXT = "Reduce benzophenone with sodium borohydride in methanol, quench with water and filter the product"

QUITTER = """
from labgym.policies import Policy

class Quitter(Policy):
    def reset(self, start):
        pass

    def act(self, observation):
        raise RuntimeError("no")
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A folder with mine.json and lab.json, made by the commands, and with bare.json, which embeds no protocol."""
    folder = tmp_path_factory.mktemp("own")
    assert main(["protocols", "new", TEXT, "--out", str(folder / "mine.json")]) == 0
    assert main(["generate", str(folder / "mine.json"), "--out", str(folder / "lab.json")]) == 0
    mine = Protocol.load(folder / "mine.json")
    assert mine.id not in protocols()
    other = get("red_01").model_copy(update={"id": "mine"})
    other.save(folder / "other.json")
    data = load_published("test", "test-red_01").to_json() | {"id": "bare", "protocols": []}
    (folder / "bare.json").write_text(json.dumps(data))
    return folder


def commands(layout: str, folder: Path) -> dict[str, list[str]]:
    out = str(folder / "out")
    (folder / "quitter.py").write_text(QUITTER)
    return {
        "score": ["score", layout],
        "view": ["view", layout, "--out", f"{out}.png"],
        "eval": ["eval", "--policy", "straight", "--layouts", layout, "--out", out],
        "record": [
            "record",
            layout,
            "--policy",
            "quitter:Quitter",
            "--width",
            "96",
            "--height",
            "96",
            "--out",
            f"{out}.gif",
        ],
    }


@pytest.mark.parametrize("name", ["score", "view", "eval", "record"])
def test_every_command_takes_a_laboratory_of_a_user_s_own_protocol(name, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    code = main(commands("lab.json", folder)[name])
    error = capsys.readouterr().err
    assert code == (1 if name == "record" else 0), error  # the recorded policy fails at once: a film of one picture
    assert "not in the library" not in error
    if name == "eval":
        assert main(["report", "out"]) == 0
        assert Protocol.load("mine.json").name in (folder / "out" / "report.html").read_text()


@pytest.mark.parametrize("name", ["score", "view", "eval", "record"])
def test_a_layout_that_does_not_embed_its_protocol_takes_it_from_the_command_line(name, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    command = commands("bare.json", folder)[name]
    if name == "eval":
        command = [*command[:-1], str(folder / "second")]
    if name in ("eval", "record"):  # the others need none
        assert main(command) == 2
        assert "the layout has no protocol: give --protocol FILE" in capsys.readouterr().err
    code = main([*command, "--protocol", "other.json"])
    assert code == (1 if name == "record" else 0), capsys.readouterr().err
    if name == "eval":
        (driven,) = (folder / "second" / "layouts").glob("*.json")
        assert Layout.load(driven).protocol == Protocol.load("other.json")


def test_a_protocol_for_a_suite_is_refused(capsys):
    assert main(["eval", "--protocol", "sub_01"]) == 2
    assert "--layouts" in capsys.readouterr().err


def test_the_environment_takes_a_layout_s_file_and_a_protocol_s_file(folder):
    mine = Protocol.load(folder / "mine.json")
    with gym.make("LabPointNav-v0", layout=folder / "lab.json") as env:
        _, info = env.reset(seed=0)
        assert info["protocol"] == mine.id
    with gym.make("LabPointNav-v0", layout=str(folder / "bare.json"), protocol=str(folder / "other.json")) as env:
        _, info = env.reset(seed=0)
        assert info["protocol"] == "mine"
        _, info = env.reset(seed=0, options={"protocol": str(folder / "mine.json"), "layout": str(folder / "lab.json")})
        assert info["protocol"] == mine.id


def test_another_process_without_the_protocol_s_file_drives_there(folder, tmp_path):
    (tmp_path / "lab.json").write_bytes((folder / "lab.json").read_bytes())
    code = (
        "import gymnasium as gym, labgym\n"
        "env = gym.make('LabPointNav-v0', layout='lab.json'); _, info = env.reset(seed=0)\n"
        "env.step(env.action_space.sample()); print(info['protocol'])"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == Layout.load(folder / "lab.json").protocol_id, done.stderr


def test_goal_pairs_take_a_protocol_s_file(folder):
    layout = Layout.load(folder / "lab.json")
    assert goal_pairs(layout, str(folder / "mine.json")) == goal_pairs(layout)
