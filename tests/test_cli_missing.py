"""Commands without optional packages, or with little memory, end in one line and exit code 2."""

from __future__ import annotations

import subprocess
import sys

import pytest

LAYOUT = "val-fgt_04"
HIDE = """
import importlib.metadata as metadata, importlib.util as util, sys
modules, distributions = ({each for each in text.split(",")} for text in sys.argv[1:3])
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in modules:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Hidden())
found, installed = util.find_spec, metadata.distribution
def distribution(name):
    if name in distributions:
        raise metadata.PackageNotFoundError(name)
    return installed(name)
util.find_spec = lambda name, package=None: None if name.split(".")[0] in modules else found(name, package)
metadata.distribution = distribution
metadata.version = lambda name: distribution(name).version
from labgym.cli import main
sys.exit(main(sys.argv[3:]))
"""


@pytest.mark.parametrize(
    ("module", "distribution", "extra", "command"),
    [
        ("pxr", "usd-core", "usd", ["compile", LAYOUT, "--format", "usd", "--out", "scene"]),
        ("ezdxf", "ezdxf", "cad", ["compile", LAYOUT, "--format", "dxf", "--out", "plan.dxf"]),
        ("pyarrow", "pyarrow", "data", ["data", "--samples", "10", "--out", "samples"]),
        ("pyarrow", "pyarrow", "data", ["data", "--format", "parquet", "--episodes", "1", "--out", "drives"]),
        ("h5py", "h5py", "data", ["data", "--format", "minari", "--episodes", "1", "--out", "drives"]),
        ("rdkit", "rdkit", "chem", ["assets", "infer", "CCO"]),
        ("torch", "torch", "train", ["train", "navdp", "--data", "samples", "--out", "run"]),
        ("stable_baselines3", "stable-baselines3", "train", ["train", "ppo", "--out", "run"]),
    ],
)
def test_a_command_without_its_extra_names_it_in_one_line(module, distribution, extra, command, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", HIDE, module, distribution, *command],
        cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert f"labgym-nav[{extra}]" in done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(sys.platform != "linux", reason="RLIMIT_AS is Linux's")
@pytest.mark.parametrize(
    ("kilobytes", "words"),
    [
        (350_000, ["compile", LAYOUT, "--out", "scene"]),
        (500_000, ["compile", LAYOUT, "--out", "scene"]),
        (700_000, ["compile", LAYOUT, "--out", "scene"]),
        (900_000, ["view", LAYOUT, "--camera", "overview"]),
        (1_000_000, ["view", LAYOUT, "--camera", "overview"]),
    ],
)
def test_little_memory_is_one_line(kilobytes, words, tmp_path):
    command = [sys.executable, "-m", "labgym.cli", *words]
    limited = ["bash", "-c", f'ulimit -v {kilobytes}; exec "$@"', "limited", *command]
    done = subprocess.run(limited, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 2, done.stderr
    assert "not enough memory" in done.stderr
    assert "Traceback" not in done.stderr
