"""The files that git tracks hold no symbolic links, such as to a shared environment."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LINK = "120000"
"""Mode of a symbolic link in git's index."""


@pytest.mark.skipif(not (ROOT / ".git").exists() or shutil.which("git") is None, reason="not a checkout")
def test_no_tracked_file_is_a_symbolic_link():
    done = subprocess.run(["git", "ls-files", "--stage"], cwd=ROOT, capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert len(lines) > 100
    assert [line for line in lines if line.startswith(LINK)] == []


@pytest.mark.skipif(not (ROOT / ".git").exists() or shutil.which("git") is None, reason="not a checkout")
@pytest.mark.parametrize("kind", ["folder", "link"])
def test_the_environment_is_ignored_whether_folder_or_link(tmp_path, kind):
    subprocess.run(["git", "init", "-q", str(tmp_path)], check=True)
    shutil.copy(ROOT / ".gitignore", tmp_path)
    environment = tmp_path / ".venv"
    environment.mkdir() if kind == "folder" else environment.symlink_to(tmp_path)
    done = subprocess.run(["git", "check-ignore", "-q", ".venv"], cwd=tmp_path, check=False)
    assert done.returncode == 0
