"""What the Makefile promises and no network is needed to see: quick the second time, one clear line on a bad Python."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
DEPENDENCIES = ("pyproject.toml", "requirements.lock", ".ci/pins")
pytestmark = pytest.mark.skipif(shutil.which("make") is None, reason="make is not installed")


@pytest.fixture
def checkout(tmp_path) -> Path:
    """A folder with the files that the install depends on, and an environment that claims to be finished."""
    (tmp_path / ".ci").mkdir()
    for name in DEPENDENCIES:
        shutil.copy2(ROOT / name, tmp_path / name)
    shutil.copy2(ROOT / "Makefile", tmp_path / "Makefile")
    (tmp_path / ".venv").mkdir()
    return tmp_path


def make(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["make", *arguments], cwd=folder, capture_output=True, text=True, check=False)


def test_install_does_nothing_the_second_time(checkout):
    assert "pip install" in make(checkout, "-n", "install").stdout
    (checkout / ".venv" / ".installed").touch()
    assert "pip" not in make(checkout, "-n", "install").stdout
    for target in ("run", "test", "lint"):
        assert "pip" not in make(checkout, "-n", target).stdout


@pytest.mark.parametrize("changed", DEPENDENCIES)
def test_install_is_done_again_when_what_it_depends_on_changes(checkout, changed):
    stamp = checkout / ".venv" / ".installed"
    stamp.touch()
    newer = stamp.stat().st_mtime + 10
    os.utime(checkout / changed, (newer, newer))
    assert "pip install" in make(checkout, "-n", "install").stdout


def test_a_python_that_is_not_there_is_one_clear_line(checkout):
    done = make(checkout, "install", "PYTHON=python-that-is-not-there")
    assert done.returncode != 0
    assert [
        line
        for line in done.stderr.splitlines()
        if line.startswith("labgym: error: python-that-is-not-there not found")
    ]


def test_a_python_that_is_too_old_is_one_clear_line(checkout):
    old = checkout / "old-python"
    old.write_text("#!/bin/sh\necho 'labgym: error: Python 3.11 or newer is needed, old-python is 3.8' >&2; exit 1\n")
    old.chmod(0o755)
    done = make(checkout, "install", f"PYTHON={old}")
    assert done.returncode != 0
    assert "3.11 or newer is needed" in done.stderr
    assert "pip install" not in done.stdout


def test_the_constraints_of_the_install_pin_every_direct_dependency_within_its_range():
    from packaging.requirements import Requirement

    printed = subprocess.run([sys.executable, ".ci/pins"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    pins = dict(line.split("==") for line in printed.splitlines())
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = [
        *project["dependencies"],
        *(text for extra in project["optional-dependencies"].values() for text in extra),
    ]
    requirements = [requirement for requirement in map(Requirement, wanted) if requirement.name != "labgym-nav"]
    assert pins.keys() == {requirement.name for requirement in requirements}
    for requirement in requirements:
        assert requirement.specifier.contains(pins[requirement.name]), requirement
    assert pins["torch"] == "2.13.0"


def test_dependencies_are_ranges_and_not_pins():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert all("==" not in text for text in project["dependencies"])
