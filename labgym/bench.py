"""Speed of the main tasks, each relative to a comparable reference task."""

from __future__ import annotations

import contextlib
import itertools
import math
import pickle
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import median, quantiles
from typing import Any

import mujoco
import numpy as np

from labgym.envs import LabPointNavEnv
from labgym.envs.robot import PREFIX, ROBOT, attach_robot
from labgym.envs.sensors import IMAGE_SHAPE, LIDAR_RAYS, RANGE, Camera, Lidar
from labgym.envs.simulation import Simulation
from labgym.envs.stage import LayoutSenses
from labgym.envs.tasks import Task
from labgym.envs.world import KEPT, World, layout_of, physics_model
from labgym.errors import MissingDependencyError, OptionError
from labgym.eval.labnav.latency import Probe, probe
from labgym.eval.labnav.suites import MINI, load_labnav
from labgym.layouts import Layout, generate, load_published, published
from labgym.navigation import PLANNING_RADIUS, ShortestPaths, astar, goal_pairs, occupancy
from labgym.policies import EpisodeStart, make_policy
from labgym.policies.policy import Driver
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.policies.registry import BUILT_IN
from labgym.scenes import MissingRendererError, make_renderer, to_mjcf
from labgym.table import Table, number

ROUNDS = 15
"""Number of timings of each task and its reference, in alternation."""

BLOCK_SECONDS = 0.05
"""Minimum duration of a block of repetitions, seconds."""

VISITS = 4
"""Resets for each layout of a split before its resets are timed: nearly all layouts are in memory then."""

Work = Callable[[], object]


@dataclass(frozen=True)
class SpeedComparison:
    """A task and its reference.

    Attributes:
        name: the work. measure: the reference.
        ours, theirs: functions that do the work and the reference once.
    """

    name: str
    measure: str
    ours: Work
    theirs: Work


@dataclass(frozen=True)
class Timing:
    """Result of a comparison.

    Attributes:
        seconds: median seconds per call of the work. reference: median seconds per call of the reference.
        ratio: median over blocks of work / reference. low, high: quartiles of the ratio.
    """

    name: str
    measure: str
    seconds: float
    reference: float
    ratio: float
    low: float
    high: float


def bench(rounds: int = ROUNDS) -> Iterator[Timing]:
    """Yield the timing of every comparison, on a published layout.

    Raises:
        OptionError: fewer than 2 rounds.
    """
    if rounds < 2:
        raise OptionError(f"rounds is {rounds}, expected at least 2")
    layout = load_published("val", published("val")[0])
    for comparison in comparisons(layout):
        yield timed(comparison, rounds)


def comparisons(layout: Layout) -> Iterator[SpeedComparison]:
    """Yield the comparisons; without OpenGL, those that need it are left out."""
    yield _control_step(layout)
    yield _lidar(layout)
    with contextlib.suppress(MissingRendererError):
        yield _depth(layout)
    yield _shortest_path(layout)
    yield _restart(layout)
    yield _generation()
    yield _new_layout()
    yield _published_split(layout)
    with contextlib.closing(PolicyProcess(PolicySource.named("straight"))) as process:
        yield _policy_step(layout, process)


def timed(comparison: SpeedComparison, rounds: int = ROUNDS, block: float = BLOCK_SECONDS) -> Timing:
    """Time work and reference alternately, so that other load on the machine affects both.

    Args:
        comparison: the work and its reference.
        rounds: number of blocks of each, at least 2.
        block: minimum duration of a block, seconds.
    """
    repeats = [_repeats(work, block) for work in (comparison.ours, comparison.theirs)]
    ours, theirs = [], []
    for _ in range(rounds):
        ours.append(_block(comparison.ours, repeats[0]))
        theirs.append(_block(comparison.theirs, repeats[1]))
    ratios = [work / reference for work, reference in zip(ours, theirs, strict=True)]
    low, _, high = quantiles(ratios, n=4)
    return Timing(comparison.name, comparison.measure, median(ours), median(theirs), median(ratios), low, high)


def bench_table(timings: Sequence[Timing]) -> Table:
    """Return timings as a table, times in milliseconds."""
    return Table(
        title="Speed: labgym relative to a reference; a ratio below 1 is faster",
        columns=("Work", "labgym, ms", "Reference", "Reference, ms", "Ratio"),
        rows=tuple(
            (
                timing.name,
                f"{1e3 * timing.seconds:.3f}",
                timing.measure,
                f"{1e3 * timing.reference:.3f}",
                f"{timing.ratio:.3f} [{timing.low:.3f}, {timing.high:.3f}]",
            )
            for timing in timings
        ),
        notes=("Medians over alternating blocks on one core; quartiles of the ratio in brackets.",),
    )


@dataclass(frozen=True)
class ThinkingTime:
    """The time of a built-in policy's actions.

    Attributes:
        policy: its name. declared: its latency, seconds. probe: its measured time; None if it gave no action.
        left_out: why it was not measured, "" if it was.
    """

    policy: str
    declared: float = 0.0
    probe: Probe | None = None
    left_out: str = ""


def thinking(names: Sequence[str] = tuple(BUILT_IN)) -> Iterator[ThinkingTime]:
    """Yield the time of the actions of built-in policies in `labnav-mini`, measured as that of a foreign policy."""
    suite = load_labnav(MINI)
    for name in names:
        source = PolicySource.named(name)
        try:
            driver = PolicyProcess(source)
        except MissingDependencyError as error:
            yield ThinkingTime(name, left_out=str(error))
            continue
        try:
            if driver.foresees:
                yield ThinkingTime(name, driver.latency, left_out="it drives in the process that simulates")
            else:
                yield ThinkingTime(name, driver.latency, probe(driver, source, suite, 0))
        finally:
            driver.close()


def thinking_table(rows: Sequence[ThinkingTime]) -> Table:
    """Return the time of the actions of policies, and the latency that it would be charged, as a table."""
    return Table(
        title="Thinking of the built-in policies: 90th percentile of the time of an action on the reference machine",
        columns=("policy", "ms", "basis", "charged s", "declared s"),
        rows=tuple(
            (
                row.policy,
                number(None if row.probe is None else 1e3 * row.probe.seconds, 2),
                "-" if row.probe is None else row.probe.basis,
                "-" if row.probe is None else f"{row.probe.latency(0.0):g}",
                f"{row.declared:g}",
            )
            for row in rows
        ),
        notes=(
            "Built-in policies drive with the latency that they declare.",
            *(f"{row.policy} is not measured: {row.left_out}." for row in rows if row.left_out),
        ),
    )


def _control_step(layout: Layout) -> SpeedComparison:
    env = LabPointNavEnv(layout=layout)
    env.reset(seed=0, options={"pair": 0})
    still = np.array([0.0, 0.4], np.float32)
    scene = Simulation(physics_model(layout))
    scene.place(goal_pairs(layout)[0].start)
    return SpeedComparison(
        "control step with lidar, reward and info",
        f"{ROBOT.substeps} MuJoCo steps alone",
        lambda: env.step(still),
        lambda: mujoco.mj_step(scene.model, scene.data, ROBOT.substeps),
    )


def _lidar(layout: Layout) -> SpeedComparison:
    world, lidar = World(layout), Lidar()
    pose = goal_pairs(layout)[0].start
    model = to_mjcf(layout, visible=False).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    origin = np.array([pose[0], pose[1], ROBOT.lidar_height])
    angles = pose[2] - math.pi + 2.0 * math.pi / LIDAR_RAYS * np.arange(LIDAR_RAYS)
    rays = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(LIDAR_RAYS)]).ravel()
    hits, distances = np.empty(LIDAR_RAYS, np.int32), np.empty(LIDAR_RAYS)
    world.solid.mesh  # noqa: B018 - built before the timing starts
    return SpeedComparison(
        f"lidar scan of {LIDAR_RAYS} rays",
        "mj_multiRay on the same boxes",
        lambda: lidar.scan(world.solid, pose),
        lambda: mujoco.mj_multiRay(model, data, origin, rays, None, 1, -1, hits, distances, None, LIDAR_RAYS, RANGE),
    )


def _depth(layout: Layout) -> SpeedComparison:
    world, camera = World(layout), Camera()
    pose = goal_pairs(layout)[0].start
    spec = to_mjcf(layout)
    attach_robot(spec)
    scene = Simulation(spec.compile())
    scene.place(pose)
    renderer = make_renderer(scene.model, IMAGE_SHAPE[1], IMAGE_SHAPE[0])
    renderer.enable_depth_rendering()

    def rasterize() -> object:
        renderer.update_scene(scene.data, PREFIX + "camera")
        return renderer.render()

    world.visible.mesh  # noqa: B018 - built before the timing starts
    return SpeedComparison(
        f"depth image of {IMAGE_SHAPE[1]} x {IMAGE_SHAPE[0]}",
        "mujoco.Renderer",
        lambda: camera.depth(world.visible, pose),
        rasterize,
    )


def _shortest_path(layout: Layout) -> SpeedComparison:
    start, goal = (pose[:2] for pose in (goal_pairs(layout)[0].start, goal_pairs(layout)[0].goal))
    paths, grid = ShortestPaths(layout), occupancy(layout).dilated(PLANNING_RADIUS)
    return SpeedComparison(
        "exact any-angle shortest path",
        "A* on the 5 cm grid, 8 neighbours",
        lambda: paths.path(start, goal),
        lambda: astar(grid, start, goal),
    )


def _restart(layout: Layout) -> SpeedComparison:
    env = LabPointNavEnv(layout=layout)
    env.reset(seed=0)
    return SpeedComparison(
        "reset in a loaded layout",
        "building the layout's physics model",
        lambda: env.reset(options={"pair": 0}),
        lambda: physics_model(layout),
    )


def _generation() -> SpeedComparison:
    scene = generate("sub_01", 1, family="bay")
    return SpeedComparison(
        "generating a room of the family bay",
        "compiling its scene in MuJoCo",
        lambda: generate("sub_01", 1, family="bay"),
        lambda: to_mjcf(scene).compile(),
    )


class _Prepared:
    """Tasks in layouts that arrive as from a pool; each comes again when its world has been forgotten."""

    def __init__(self, layouts: Sequence[Layout]) -> None:
        self._sent = itertools.cycle(
            [pickle.dumps(World(layout).stage(LayoutSenses()), protocol=5) for layout in layouts]
        )

    def draw(self, rng: np.random.Generator, options: Mapping[str, Any], fresh: bool) -> Task:  # noqa: ARG002
        """Return a drive in the next layout."""
        layout = layout_of(pickle.loads(next(self._sent)))  # noqa: S301 -- made above
        return Task(layout, layout.protocol, goal_pairs(layout)[0])

    def close(self) -> None:
        """Keep the layouts."""


def _new_layout() -> SpeedComparison:
    layouts = [layout for name in published("val") if goal_pairs(layout := load_published("val", name))][: KEPT + 2]
    env, following = LabPointNavEnv(tasks=_Prepared(layouts)), itertools.cycle(layouts)
    env.reset(seed=0)
    return SpeedComparison(
        "reset in a new layout that a pool has prepared",
        "preparing it",
        env.reset,
        lambda: World(next(following)).stage(LayoutSenses()),
    )


def _published_split(layout: Layout) -> SpeedComparison:
    env = LabPointNavEnv(split="test")
    for _ in range(VISITS * len(published("test"))):
        env.reset()
    return SpeedComparison(
        "reset in a random layout of the split test",
        "building a layout's physics model",
        env.reset,
        lambda: physics_model(layout),
    )


def _policy_step(layout: Layout, process: PolicyProcess) -> SpeedComparison:
    env, policy = LabPointNavEnv(layout=layout), make_policy("straight")
    observation, _ = env.reset(seed=0, options={"pair": 0})
    distance, cosine, sine = (float(value) for value in observation["goal"])
    policy_observation = {**observation, "odometry": np.zeros(3)}
    drivers: tuple[Driver, ...] = process, policy
    for driver in drivers:
        driver.reset(EpisodeStart((distance * cosine, distance * sine), np.random.default_rng(0)))
    still = np.zeros(2, np.float32)

    def step(driver: Driver) -> None:
        driver.act(policy_observation)
        env.step(still)

    return SpeedComparison(
        "control step with lidar and a policy in its own process",
        "the same with the policy in this process",
        lambda: step(process),
        lambda: step(policy),
    )


def _repeats(work: Work, block: float) -> int:
    work()
    return max(1, math.ceil(block / _block(work, 1)))


def _block(work: Work, repeats: int) -> float:
    """Return the mean wall-clock seconds per call, averaged over `repeats` calls."""
    begin = time.perf_counter()
    for _ in range(repeats):
        work()
    return (time.perf_counter() - begin) / repeats
