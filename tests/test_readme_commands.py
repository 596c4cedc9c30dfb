"""The `labgym` commands of README and docs/commands.md exist with their options; those on shipped files work."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from pages import blocks

from labgym.cli import main
from labgym.cli.commands import COMMANDS as ALL_COMMANDS
from labgym.cli.commands import CommandGroup

ROOT = Path(__file__).resolve().parents[1]
PAGES = ("README.md", "docs/commands.md")


def commands(page: str) -> list[list[str]]:
    """Return the words of each command of a page, without `labgym`."""
    text = re.sub(r"\\\n\s*", "", (ROOT / page).read_text(encoding="utf-8"))
    return [shlex.split(line, comments=True)[1:] for line in text.splitlines() if line.startswith("    labgym ")]


COMMANDS = {page: commands(page) for page in PAGES}
TUTORIALS = [
    shlex.split(line, comments=True)[1:]
    for page in sorted(ROOT.glob("docs/tutorials/*.md"))
    for language, code in blocks(page.read_text(encoding="utf-8"))
    if language != "python"
    for line in re.sub(r"\\\n\s*", "", code).splitlines()
    if line.startswith("labgym ")
]
READERS = ("mine:GoToGoal", "runs/", "data.pb.gz", "imported", "models/")
"""Beginnings of arguments that stand for the reader's own files."""

SLOW = ("record", "reproduce", "eval", "report", "compile")
"""Commands with tests of their own that take longer than all others together."""

HELP: dict[tuple[str, ...], str] = {}
"""Help of the commands that have been asked for it."""

EXTRAS = {"infer": "rdkit", "build": "pxr"}


def command_path(words: list[str]) -> list[str]:
    """Return the names of the command and of its group's command."""
    group = ALL_COMMANDS[words[0]]
    return [words[0], *([group.named(words[1:])[0]] if isinstance(group, CommandGroup) else [])]


@pytest.mark.parametrize("words", [*(words for page in PAGES for words in COMMANDS[page]), *TUTORIALS], ids=" ".join)
def test_a_command_exists_and_takes_its_options(words, capsys):
    path = tuple(command_path(words))
    if path not in HELP:
        with pytest.raises(SystemExit) as end:
            main([*path, "--help"])
        assert end.value.code == 0
        HELP[path] = capsys.readouterr().out
    for option in (word for word in words if word.startswith("--")):
        assert option in HELP[path]


def test_the_commands_on_shipped_files_work_in_their_order(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    ran = 0
    for words in COMMANDS["docs/commands.md"]:
        names = command_path(words)
        if words[0] in SLOW or any(word.startswith(READERS) for word in words):
            continue
        if names[-1] in EXTRAS:
            pytest.importorskip(EXTRAS[names[-1]])
        assert main(words) == 0, (words, capsys.readouterr().err)
        ran += 1
    assert ran >= 10
    assert {"sub_01-roomy-3.json", "plan.pdf", "mine.json", "lab.json"} <= {path.name for path in tmp_path.iterdir()}
