from __future__ import annotations

import subprocess
import sys

HEAVY = ("torch", "stable_baselines3", "pxr", "ortools", "matplotlib", "mujoco", "cv2", "embreex")


def loaded_by(code: str) -> set[str]:
    """The top-level packages that a fresh interpreter has loaded after some code."""
    code += "\nimport sys; print(*sorted({name.partition('.')[0] for name in sys.modules}))"
    return set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split())


def test_importing_labgym_loads_nothing_heavy():
    assert loaded_by("import labgym").isdisjoint(HEAVY)


def test_no_package_loads_learning_or_usd_before_they_are_used():
    loaded = loaded_by("import labgym.layouts, labgym.cli, labgym.eval, labgym.policies")
    assert loaded.isdisjoint({"torch", "stable_baselines3", "pxr", "matplotlib", "ortools"})
