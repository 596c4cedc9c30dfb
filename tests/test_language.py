"""`make lint` checks the English of docstrings, comments, messages and pages; here its checker is tested."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def language():
    spec = importlib.util.spec_from_file_location("language", ROOT / ".ci" / "language.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("file", "text", "fault"),
    [
        ("a.py", '"""Return nothing."""\nMESSAGE = "mend the file"\n', "a.py:2: 'mend' (fix)"),
        ("a.py", '"""Return nothing."""\n\n# It has a name of its own.\n', "a.py:3: 'of its own' (separate, its)"),
        ("a.py", 'def f():\n    """What it returns."""\n', "a.py:1: a docstring begins with a clause"),
        ("a.py", '"""Return the colour."""\n', "a.py:1: British spelling 'colour'"),
        ("a.md", "One\ntwo metres\n", "a.md:2: British spelling 'metres'"),
    ],
)
def test_a_fault_is_named_with_its_line(language, tmp_path, file, text, fault):
    path = tmp_path / file
    path.write_text(text)
    (line,) = language.faults(path)
    assert line.startswith(fault)


def test_names_in_code_are_not_prose(language, tmp_path):
    path = tmp_path / "a.py"
    path.write_text('"""Return `colour_and_depth(scene)` of a scene."""\n\ncolour = centre = 1\n')
    assert [*language.faults(path)] == []


def test_the_checker_reads_the_modules_and_the_pages(language):
    names = {path.relative_to(ROOT).as_posix() for path in language.sources()}
    assert {"README.md", "labgym/errors.py", "docs/labnav.md"} <= names
