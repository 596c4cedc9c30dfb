"""Print the digests of what the published networks compute from recorded observations, as a line of JSON.

`tests/policies/test_kernels.py` runs this file in a process with the variables of the pinned mode. By hand, on an
emulated processor without AVX-512: `qemu-x86_64 -cpu Haswell python tests/policies/kernels/outputs.py iplanner ppo`.
"""

from __future__ import annotations

import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from labgym.envs.robot import ROBOT
from labgym.policies import EpisodeStart, make_policy
from labgym.policies.kernels import kernel_facts, pin_torch

OBSERVATIONS = Path(__file__).with_name("observations.npz")
COUNT = 4


def observation(number: int) -> dict[str, Any]:
    """Return a recorded observation with all sensors; ranges were stored in millimeters."""
    with np.load(OBSERVATIONS) as arrays:
        ranges = {name: arrays[f"{name}{number}"].ravel() / np.float32(1000.0) for name in ("depth", "lidar")}
        exact = {name: arrays[f"{name}{number}"] for name in ("rgb", "goal", "velocity", "odometry")}
    return {**ranges, **exact}


def digest(arrays: list[Any]) -> str:
    """Return a digest of arrays, shapes and bits."""
    value = hashlib.sha256()
    for array in arrays:
        value.update(str(np.shape(array)).encode() + np.ascontiguousarray(array, dtype=np.float64).tobytes())
    return value.hexdigest()[:16]


def outputs(name: str) -> str:
    """Return the digest of a policy's actions, each at the start of an episode, and of its network's answers."""
    policy: Any = make_policy(name)
    pin_torch()
    results: list[Any] = []
    for number in range(1 if name == "navdp" else COUNT):
        seen = observation(number)
        distance, cosine, sine = (float(value) for value in seen["goal"])
        goal = distance * cosine, distance * sine
        policy.reset(EpisodeStart(goal=goal, rng=np.random.default_rng(number), robot=ROBOT, truth=None))
        results.append(policy.act(seen))
        depth = seen["depth"].reshape(72, 128)
        if name == "navdp":
            results += list(policy.drawn_from(seen["rgb"], depth, goal, seed=number))
        elif name == "iplanner":
            results.append(policy.plan(depth, goal))
    return digest(results)


if __name__ == "__main__":
    sys.stdout.write(json.dumps({**{name: outputs(name) for name in sys.argv[1:]}, "facts": kernel_facts()}) + "\n")
