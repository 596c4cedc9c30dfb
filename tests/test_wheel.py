"""The wheel carries all that labgym needs: built, installed into a fresh environment, and used outside the checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    subprocess.run(command, capture_output=True, text=True, check=True)
    return next(folder.glob("labgym_nav-*.whl"))


@pytest.fixture(scope="module")
def python(wheel, tmp_path_factory) -> Path:
    """An interpreter of a fresh environment: the wheel, and this environment's packages but for labgym itself."""
    folder = tmp_path_factory.mktemp("fresh") / "venv"
    venv.create(folder)
    python = folder / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", python]
    subprocess.run([*pip, "install", "--quiet", "--no-compile", "--no-deps", "--no-index", wheel], check=True)
    # A path file inside a path file's folder is not followed, so the checkout's editable install stays unseen.
    packages = folder / "lib" / f"python{sys.version_info.major}.{sys.version_info.minor}" / "site-packages"
    (packages / "borrowed.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return python


def run(python: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    return subprocess.run(
        [python, *arguments], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def test_the_wheel_holds_every_artefact_and_the_type_marker(wheel):
    inside = {name for name in zipfile.ZipFile(wheel).namelist() if "/_artefacts/" in name}
    for folder in ("assets", "layouts", "policies", "eval"):
        tracked = subprocess.run(
            ["git", "ls-files", folder], cwd=ROOT, capture_output=True, text=True, check=False
        ).stdout
        assert {f"labgym/_artefacts/{path}" for path in tracked.splitlines()} <= inside
        assert any(name.startswith(f"labgym/_artefacts/{folder}/") for name in inside)
    assert "labgym/py.typed" in zipfile.ZipFile(wheel).namelist()
    assert "labgym/eval/reports/templates/site.html.j2" in zipfile.ZipFile(wheel).namelist()
    assert not [name for name in zipfile.ZipFile(wheel).namelist() if name.startswith(("tests/", "docs/", "runs/"))]


def test_outside_the_checkout_the_wheel_s_package_is_the_one_imported(python, tmp_path):
    done = run(python, tmp_path, "-c", "import labgym; print(labgym.__file__)")
    assert done.stdout.startswith(str(python.parents[1])), done.stderr


def test_an_environment_is_made_from_the_wheel(python, tmp_path):
    code = (
        "import gymnasium as gym, labgym\n"
        "env = gym.make('LabPointNav-v0', split='test')\n"
        "env.reset(seed=0); print(env.step(env.action_space.sample())[4]['layout'])"
    )
    done = run(python, tmp_path, "-c", code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("test-")


@pytest.mark.slow
def test_the_command_of_the_wheel_works(python, tmp_path):
    done = run(python, tmp_path, str(python.parent / "labgym"), "doctor")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "wheel" in done.stdout.splitlines()[0]
    done = run(python, tmp_path, str(python.parent / "labgym"), "view", "test-sub_01", "--out", "lab.png")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "lab.png").read_bytes().startswith(b"\x89PNG")


def test_policies_in_the_working_folder_are_found(python, tmp_path):
    (tmp_path / "mine.py").write_text(
        "import numpy as np\nfrom labgym.policies import Policy\n"
        "class Still(Policy):\n    name = 'still'\n    def reset(self, episode): pass\n"
        "    def act(self, observation): return np.zeros(2)\n"
    )
    command = [
        str(python.parent / "labgym"),
        "eval",
        "--policy",
        "mine:Still",
        "--layouts",
        "test-sub_02",
        "--out",
        "e",
    ]
    done = run(python, tmp_path, *command)
    assert done.returncode == 0, done.stderr
    assert "0.000" in done.stdout
