"""Commands without optional packages, or with little memory, end in one line and exit code 2."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

import labgym
from labgym.cli.problems import EXTRAS, problem_line

LAYOUT = "val-fgt_04"
HIDE = """
import importlib.metadata as metadata, importlib.util as util, json, os, sys
from pathlib import Path
import labgym.cli.app, labgym.envs.tasks, labgym.eval.evaluator, labgym.policies
for name in [name for name in sys.modules if name.partition(".")[0] == "yaml"]:
    del sys.modules[name]  # numba has looked for it
found, installed = util.find_spec, metadata.distribution
def run(plan):
    modules, distributions = map(set, plan["hide"])
    class Hidden:
        def find_spec(self, name, path=None, target=None):
            if name.split(".")[0] in modules:
                raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    def find_spec(name, package=None):
        return None if name.split(".")[0] in modules else found(name, package)
    def distribution(name):
        if name in distributions:
            raise metadata.PackageNotFoundError(name)
        return installed(name)
    sys.meta_path.insert(0, Hidden())
    util.find_spec, metadata.distribution = find_spec, distribution
    metadata.version = lambda name: distribution(name).version
    for name, module in list(sys.modules.items()):
        if name.split(".")[0] in modules:
            del sys.modules[name]
        elif getattr(module, "find_spec", None) is found and name.startswith("labgym"):
            module.find_spec = find_spec
    return labgym.cli.main(plan["words"])
plans = json.loads(sys.argv[1])
for plan in plans:
    assert not set(plan["hide"][0]) & set(sys.modules), "an optional package was imported before the fork"
for plan in plans:
    child = os.fork()
    if child == 0:
        os.chdir(plan["folder"])
        for number, name in ((1, "stdout"), (2, "stderr")):
            os.dup2(os.open(name, os.O_CREAT | os.O_WRONLY), number)
        code = 99
        try:
            code = run(plan)
        except BaseException as error:
            code = repr(error)
        finally:
            sys.stderr.flush()
            Path("code").write_text(str(code))
            os._exit(0)
    os.waitpid(child, 0)
"""


DASK = ["--executor", "dask", "--scheduler", "tcp://127.0.0.1:9"]
SLURM = ["--executor", "slurm"]
COMMANDS = {
    "cad": [
        ["compile", LAYOUT, "--format", "dxf", "--out", "o.dxf"],
        ["outline", "a.dxf", "--out", "o.json"],
        ["outline", "map.yaml", "--out", "o.json"],
        ["generate", "sub_01", "--room", "a.dxf"],
        ["generate", "sub_01", "--room", "map.yaml"],
        ["generate", "sub_01", "--fixed", "a.dxf"],
    ],
    "bim": [["compile", LAYOUT, "--format", "ifc", "--out", "o.ifc"], ["outline", "a.ifc", "--out", "o.json"]],
    "ros": [["record", LAYOUT, "--out", "o.mcap"]],
    "chem": [["assets", "infer", "CCO"], ["assets", "add-reagent", "x", "--smiles", "CCO"]],
    "dask": [
        ["generate", "sub_01", "--count", "1", "--out", "o", *DASK],
        ["eval", "--policy", "straight", "--out", "o", *DASK],
        ["floors", "--split", "floors-val", "--out", "o", *DASK],
        ["labnav", "--split", "floors-val", "--out", "o", *DASK],
        ["describe", "splits", *DASK],
        ["score", LAYOUT, "--out", "o", *DASK],
        ["run", "--out", "o", "--seed", "1", "--protocols", "sub_01", *DASK],
        ["reproduce", "protocols", "--out", "o", *DASK],
        ["data", "--out", "o", *DASK],
    ],
    "slurm": [
        ["generate", "sub_01", "--count", "1", "--out", "o", *SLURM],
        ["eval", "--policy", "straight", "--out", "o", *SLURM],
    ],
    "data": [
        ["data", "--samples", "10", "--out", "o"],
        ["data", "--format", "parquet", "--episodes", "1", "--out", "o"],
        ["data", "--format", "lerobot", "--episodes", "1", "--out", "o"],
        ["data", "--format", "minari", "--episodes", "1", "--out", "o"],
    ],
    "ord": [["protocols", "import", "a.pbtxt", "--format", "ord", "--out", "o"]],
    "train": [
        ["train", "navdp", "--out", "o"],
        ["train", "iplanner", "--out", "o"],
        ["train", "ppo-imitation", "--out", "o"],
        ["train", "ppo", "--out", "o"],
        ["train", "sac", "--out", "o"],
        ["train", "recurrent-ppo", "--out", "o"],
        ["train", "her", "--out", "o"],
        ["train", "local-practice", "--out", "o"],
        ["train", "local-imitation", "--out", "o"],
        ["train", "local-ppo", "--out", "o"],
        ["ablate", "iplanner", "--out", "o"],
        ["ablate", "navdp", "--out", "o"],
        ["ablate", "local-imitation", "--out", "o"],
        ["ablate", "local-ppo", "--out", "o"],
        ["data", "--learner", "a", "--out", "o"],
    ],
    "usd": [
        ["compile", LAYOUT, "--format", "usd", "--out", "o"],
        ["compile", LAYOUT, "--format", "usd", "--interactive", "--out", "o"],
        ["assets", "build", "rotovap", "--out", "o"],
    ],
}
"""Commands by the extra that they require."""
WITHOUT = {"opsin", "embed", "fast", "llm", "mesh", "onnx", "warp"}
"""Extras without which commands work otherwise, or that an environment, the configured model or a policy's own process
requires."""
DEPENDENCIES = tomllib.loads(Path(__file__).parents[1].joinpath("pyproject.toml").read_text())["project"]
EXTRAS_OF = DEPENDENCIES["optional-dependencies"]


def hidden(extra):
    """Return the modules and the distributions of an extra, as pyproject.toml lists them."""
    names = {re.split(r"[<>=; \[]", requirement)[0] for requirement in EXTRAS_OF[extra]}
    return {module.split(".")[0] for module, (name, _) in EXTRAS.items() if name in names}, names


@pytest.fixture(scope="module")
def answers(tmp_path_factory):
    """Run all commands without their extras in forks of a process that has imported what most of them use."""
    folder = tmp_path_factory.mktemp("missing")
    plan = [
        {"folder": str(folder / f"{extra}-{number}"), "hide": [sorted(part) for part in hidden(extra)], "words": words}
        for extra, commands in COMMANDS.items()
        for number, words in enumerate(commands)
    ]
    for one in plan:
        Path(one["folder"]).mkdir()
        for name in ("a.dxf", "a.onnx", "a.safetensors", "a.usdc", "a.pbtxt", "a.ifc"):
            (Path(one["folder"]) / name).touch()
        (Path(one["folder"]) / "map.yaml").write_text("image: map.png\nresolution: 0.05\norigin: [0, 0, 0]\n")
    subprocess.run([sys.executable, "-c", HIDE, json.dumps(plan)], check=True, timeout=1200)
    return folder


@pytest.mark.parametrize(
    ("extra", "number"), [(extra, number) for extra in COMMANDS for number in range(len(COMMANDS[extra]))]
)
def test_a_command_without_its_extra_names_it_in_one_line(answers, extra, number):
    folder = answers / f"{extra}-{number}"
    errors = (folder / "stderr").read_text()
    assert (folder / "code").read_text() == "2", errors
    assert len(errors.splitlines()) == 1, errors
    assert f"labgym-nav[{extra}]" in errors
    assert not (folder / "o").exists()
    assert not list(folder.glob("o.*"))


def test_every_extra_is_tested_or_replaced_by_something_else():
    assert set(COMMANDS) | WITHOUT == set(EXTRAS_OF) - {"all", "dev", "docs"}


IMPORTED = re.compile(r"^\s*(?:from|import)\s+(\w+)", re.MULTILINE)


def test_every_package_that_is_no_dependency_has_its_extra_in_the_message():
    required = {re.split(r"[<>=; \[]", each)[0].lower() for each in DEPENDENCIES["dependencies"]}
    provided = metadata.packages_distributions()
    usual = {*sys.stdlib_module_names, "labgym", *EXTRAS}
    usual |= {top for top, names in provided.items() if {name.lower() for name in names} & required}
    for file in Path(labgym.__file__).parent.rglob("*.py"):
        text = file.read_text()
        if {*IMPORTED.findall(text)} <= usual:
            continue
        for node in ast.walk(ast.parse(text)):
            names = [each.name for each in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
            for name in names:
                top = name.split(".")[0]
                known = (
                    top in sys.stdlib_module_names
                    or top == "labgym"
                    or {each.lower() for each in provided.get(top, ())} & required
                )
                known = known or top in ("mpl_toolkits", "pydantic_core")
                assert known or top in EXTRAS or "google.protobuf" in name, f"{file}: {name}"
    for name, extra in EXTRAS.values():
        listed = {re.split(r"[<>=; \[]", each)[0] for each in EXTRAS_OF[extra]}
        assert name in listed, (name, extra)


@pytest.mark.skipif(sys.platform != "linux", reason="RLIMIT_AS is Linux's")
@pytest.mark.parametrize(
    ("kilobytes", "words"),
    [
        (350_000, ["compile", LAYOUT, "--out", "scene"]),
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


def test_memory_that_ends_in_the_middle_of_the_work_is_one_line_too():
    cause = OSError("libscipy.so: failed to map segment from shared object")
    for error in (MemoryError(), cause):
        assert "not enough memory for labgym view" in str(problem_line(error, "labgym view"))
    wrapped = ImportError("scipy")
    wrapped.__cause__ = cause
    assert "not enough memory" in str(problem_line(wrapped, "labgym view"))
    assert problem_line(ValueError("no"), "labgym view") is None
