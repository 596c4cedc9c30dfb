"""Steps per second of our environments, relative to `PointMaze_UMaze-v3` of Gymnasium-Robotics in the same run."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from statistics import median
from typing import Any

import gymnasium as gym
import numpy as np

from labgym.errors import MissingDependencyError, OptionError, optional_package
from labgym.layouts import Layout, load_published, published
from labgym.table import Table

REFERENCE = "PointMaze_UMaze-v3"
EPISODE = 100
"""Steps after which our episodes end, so that resets are a part of the work."""
NUM_ENVS = 64
BLOCK_SECONDS = 0.1
"""Minimum duration of a block of steps, seconds."""
ACTIONS = 499
"""Number of random actions that are repeated."""


@dataclass(frozen=True)
class Throughput:
    """Speed of an environment.

    Attributes:
        name: the environment.
        steps: environment steps per second of wall-clock time, median over blocks.
        wall: the same relative to the reference, median over blocks.
        processor: environment steps per second of processor time relative to the reference, median over blocks. Other
            load on the machine distorts it less; threads count as a sum.
    """

    name: str
    steps: float
    wall: float
    processor: float


def throughput(rounds: int, layout: Layout | None = None) -> Iterator[Throughput]:
    """Yield the speed of each environment; blocks of all environments alternate.

    Args:
        rounds: number of blocks of each.
        layout: by default a published one.

    Raises:
        MissingDependencyError: Gymnasium-Robotics is not installed.
        OptionError: fewer than 2 rounds.
    """
    if rounds < 2:
        raise OptionError(f"rounds is {rounds}, expected at least 2")
    layout = load_published("val", published("val")[0]) if layout is None else layout
    runs = {name: Run(make()) for name, make in environments(layout).items()}
    blocks: dict[str, list[tuple[float, float]]] = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            blocks[name].append(run.block())
    for name, ours in blocks.items():
        pairs = list(zip(ours, blocks[REFERENCE], strict=True))
        yield Throughput(
            name,
            1.0 / median(wall for wall, _ in ours),
            median(reference[0] / own[0] for own, reference in pairs),
            median(reference[1] / own[1] for own, reference in pairs),
        )
    for run in runs.values():
        run.env.close()


def environments(layout: Layout) -> dict[str, Callable[[], Any]]:
    """Return the functions that make the environments; those of the planar kernel only if numba is installed.

    Raises:
        MissingDependencyError: Gymnasium-Robotics is not installed.
    """
    with optional_package("gymnasium-robotics", "the comparison with PointMaze", "dev"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import gymnasium_robotics
    gym.register_envs(gymnasium_robotics)
    ours: dict[str, Any] = {"layout": layout, "max_episode_steps": EPISODE}
    made: dict[str, Callable[[], Any]] = {
        REFERENCE: lambda: gym.make(REFERENCE),
        "lidar, MuJoCo": lambda: gym.make("LabPointNav-v0", **ours),
        f"{NUM_ENVS} x lidar, MuJoCo, SyncVectorEnv": lambda: gym.make_vec(
            "LabPointNav-v0", NUM_ENVS, vectorization_mode="sync", **ours
        ),
        "depth camera, MuJoCo": lambda: gym.make("LabPointNav-v0", observation="depth", **ours),
        "color and depth camera, MuJoCo": lambda: gym.make("LabPointNav-v0", observation="rgbd", **ours),
    }
    with suppress(MissingDependencyError):
        import labgym.envs.planar.compiled

        made["lidar, planar kernel"] = lambda: gym.make("LabPointNav-v0", physics="planar", **ours)
        made[f"{NUM_ENVS} x lidar, vector environment"] = lambda: gym.make_vec(
            "LabPointNav-v0", NUM_ENVS, vectorization_mode="vector_entry_point", **ours
        )
        made["depth camera, planar kernel"] = lambda: gym.make(
            "LabPointNav-v0", physics="planar", observation="depth", **ours
        )
        made[f"{NUM_ENVS} x depth camera, vector environment"] = lambda: gym.make_vec(
            "LabPointNav-v0", NUM_ENVS, vectorization_mode="vector_entry_point", observation="depth", **ours
        )
    with suppress(MissingDependencyError):
        import labgym.envs.gpu  # noqa: F401

        made[f"{NUM_ENVS} x lidar, Warp on one core"] = lambda: gym.make_vec(
            "LabPointNav-v0", NUM_ENVS, vectorization_mode="vector_entry_point", device="cpu", **ours
        )
    return made


def left_out() -> tuple[str, ...]:
    """Return a line for each extra that is not installed and whose environments are therefore not measured."""
    lines = []
    for package, extra in (("numba", "fast"), ("warp", "warp")):
        if find_spec(package) is None:
            lines.append(f"Not measured without the extra {extra}: pip install 'labgym-nav[{extra}]'.")
    return tuple(lines)


class Run:
    """An environment that is driven with random actions.

    Args:
        env: a single environment or a vector environment.
    """

    def __init__(self, env: Any) -> None:
        self.env = env
        self._count = int(getattr(env, "num_envs", 1))
        self._single = not hasattr(env, "num_envs")
        rng = np.random.default_rng(0)
        self._actions = rng.uniform(-1.0, 1.0, (ACTIONS, *env.action_space.shape)).astype(np.float32)
        self._place = 0
        env.reset(seed=0)
        self._step()
        begin = time.perf_counter()
        self._step()
        self._steps = max(1, round(BLOCK_SECONDS / (time.perf_counter() - begin)))

    def block(self) -> tuple[float, float]:
        """Return the wall-clock and the processor seconds of an environment step, averaged over a block."""
        wall, processor = time.perf_counter(), time.process_time()
        for _ in range(self._steps):
            self._step()
        count = self._steps * self._count
        return (time.perf_counter() - wall) / count, (time.process_time() - processor) / count

    def _step(self) -> None:
        self._place = (self._place + 1) % ACTIONS
        _, _, terminated, truncated, _ = self.env.step(self._actions[self._place])
        if self._single and (terminated or truncated):
            self.env.reset()


def throughput_table(measured: Sequence[Throughput]) -> Table:
    """Return the speeds as a table."""
    return Table(
        title=f"Environment steps per second, relative to {REFERENCE}; a ratio above 1 is faster",
        columns=("Environment", "Steps/s", "Ratio", "Ratio of processor time"),
        rows=tuple((one.name, f"{one.steps:,.0f}", f"{one.wall:.2f}", f"{one.processor:.2f}") for one in measured),
        notes=(
            f"Medians over alternating blocks; random actions; our episodes end after {EPISODE} steps.",
            *left_out(),
        ),
    )
