"""Run a command of every extra with the installed versions; fail on the first that does not work."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import requires, version
from pathlib import Path

from packaging.requirements import Requirement

LABGYM = str(Path(sys.executable).parent / "labgym")
COMMANDS = (
    ("--version",),
    ("doctor",),
    ("generate", "sub_01", "--room", "bay", "--out", "a.json"),
    ("score", "a.json"),
    ("view", "a.json", "--out", "a.png"),
    ("view", "a.json", "--camera", "overview", "--out", "b.png", "--width", "160", "--height", "120"),
    ("compile", "a.json", "--out", "scene"),
    ("compile", "a.json", "--format", "usd", "--out", "usd"),
    ("compile", "a.json", "--format", "dxf", "--format", "pdf", "--format", "bom", "--format", "ros", "--out", "files"),
    ("outline", "files/ros/map.yaml", "--out", "c.json"),
    ("generate", "sub_01", "--room", "files/ros/map.yaml", "--out", "d.json"),
    ("eval", "--policy", "straight", "--layouts", "a.json", "--out", "straight"),
    ("eval", "--policy", "ppo", "--layouts", "a.json", "--out", "ppo"),
    ("record", "a.json", "--policy", "straight", "--out", "drive.gif", "--width", "96", "--height", "96"),
    ("report", "straight"),
    ("protocols", "search", "esterification of benzoic acid"),
    ("assets", "find", "rotary evaporator"),
    ("assets", "infer", "CCO"),
    ("policies",),
    ("data", "--samples", "2", "--out", "data"),
)
SNIPPETS = (
    "import gymnasium, labgym; gymnasium.make('LabPointNav-v0', split='test', observation='rgbd').reset(seed=0)",
    "from labgym.policies import make_policy; make_policy('navdp'); make_policy('iplanner'); make_policy('ppo-depth')",
    "import onnxruntime, coacd, pxr.Usd, distributed, submitit, stable_baselines3, diffusers, openai, google.protobuf",
    "import ezdxf, ifcopenshell, numba, rosbags, warp, yaml",
    "from labgym.policies.data import load_dataset; assert len(load_dataset('data')) == 2",
    "from labgym.llm import LanguageModel, LanguageModelConfig as C; LanguageModel(C(base_url='http://127.0.0.1:1/v1', "
    "model='m'))._connected().close()",
    "from labgym.protocols.importers.ord_messages import messages; messages()",
)


def main() -> int:
    """Run all commands and return the number of those that failed."""
    for line in requires("labgym-nav") or ():
        requirement = Requirement(line)
        if requirement.marker is None or requirement.marker.evaluate({"extra": "all"}):
            print(f"{requirement.name} {version(requirement.name)}", end="; ")
    print()
    failed = 0
    steps = [(" ".join(words), [LABGYM, *words]) for words in COMMANDS]
    for name, command in [*steps, *((text[:60], [sys.executable, "-c", text]) for text in SNIPPETS)]:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=900)
        print("ok    " if done.returncode == 0 else "failed", name, flush=True)
        if done.returncode:
            failed += 1
            print(*(done.stderr or done.stdout).splitlines()[-15:], sep="\n")
    return failed


if __name__ == "__main__":
    sys.exit(main())
