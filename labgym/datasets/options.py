"""Options of a dataset of drives: task, floors, expert, sensors and format, and the environment that follows."""

from __future__ import annotations

import copy
from typing import Annotated, Any, Literal, get_args

import gymnasium as gym
from gymnasium.envs.registration import EnvSpec
from pydantic import Field

from labgym.documents import Record
from labgym.envs.labnav.task import LabNavTask
from labgym.envs.labnav.tasks import TASKS, task_of
from labgym.envs.presets import labnav_config_name, labnav_id
from labgym.errors import OptionError, UnknownNameError, check_name
from labgym.policies.registry import BUILT_IN

Format = Literal["parquet", "minari", "lerobot"]
Sensors = Literal["lidar", "depth", "rgbd"]
FORMATS: tuple[Format, ...] = get_args(Format)

POINT = "point"
"""The task of drives that rest at a point; it is none of LabNav's."""
POINT_IDS = {"lidar": "LabFloorNav-v0", "depth": "LabFloorNavDepth-v0", "rgbd": "LabFloorNavRGBD-v0"}
TRAINING_SPLITS = ("floors-train", "train")
VALIDATION_SPLITS = ("floors-val", "val")
SPLITS = (*TRAINING_SPLITS, *VALIDATION_SPLITS)
ROOM_SPLITS = ("train", "val")
DEFAULT_POLICY = {POINT: "astar"}
"""Experts of tasks other than LabNav's, whose expert is `stack`."""


class DriveOptions(Record):
    """Options that determine every byte of a dataset of drives, given the versions of labgym and its dependencies.

    Attributes:
        format: of the files.
        task: of LabNav, or "point". level: 1 to 3; "point" has level 1 alone.
        split: of the layouts. policy: name of a built-in policy, the expert.
        sensors: of the observations; the expert may have others.
        episodes: number of episodes. shard: of them in a shard, the unit of work and of resuming.
        seed: episode k draws its environment seeds from [seed, k, attempt].
        successful: whether an episode that fails is drawn again.
    """

    format: Format
    task: str = "people"
    level: Annotated[int, Field(ge=1, le=3)] = 2
    split: str = "floors-train"
    policy: str = "stack"
    sensors: Sensors = "lidar"
    episodes: Annotated[int, Field(ge=1, le=1_000_000)] = 100
    seed: Annotated[int, Field(ge=0, lt=2**53)] = 0
    shard: Annotated[int, Field(ge=1, le=10_000)] = 10
    successful: bool = False

    @property
    def shards(self) -> int:
        """Number of shards."""
        return -(-self.episodes // self.shard)

    def numbers(self, shard: int) -> range:
        """Return the numbers of the episodes of a shard."""
        return range(shard * self.shard, min((shard + 1) * self.shard, self.episodes))

    @property
    def task_id(self) -> str:
        """Identifier of task and level, such as "labnav-people-2"."""
        return f"{self.task}-navigation" if self.task == POINT else f"labnav-{self.task}-{self.level}"

    @property
    def name(self) -> str:
        """Name of the dataset, such as "labgym/people-2-stack-lidar-v0"; a valid id for Minari and LeRobot."""
        level = "" if self.task == POINT else f"-{self.level}"
        held = "" if self.split == "floors-train" else f"-{self.split}"
        good = "-successful" if self.successful else ""
        return f"labgym/{self.task}{level}-{self.policy}-{self.sensors}{held}{good}-v0"

    @property
    def labnav(self) -> LabNavTask | None:
        """The task of LabNav; None for "point"."""
        return None if self.task == POINT else task_of(self.task)

    @property
    def spec(self) -> EnvSpec:
        """Specification for `gym.make` of the environment that the drives are of."""
        point = self.task == POINT
        spec = copy.deepcopy(gym.spec(POINT_IDS[self.sensors] if point else labnav_id(self.task)))
        config = spec.id if point else labnav_config_name(self.task, self.level, self.sensors)
        spec.kwargs = {"config": config, "split": self.split, "exact": True} | ({} if point else {"stop": "action"})
        return spec

    @property
    def max_steps(self) -> int:
        """Number of actions after which an episode is truncated."""
        return int(self.spec.max_episode_steps or 0)


def drive_options(task: str, policy: str | None, split: str | None, level: int | None, **values: Any) -> DriveOptions:
    """Return checked options.

    Args:
        task: of LabNav, or "point".
        policy, split, level: None for the defaults of the task: "stack" on "floors-train" at level 2, or "astar" in
            "train".
        values: further fields of `DriveOptions`.

    Raises:
        UnknownNameError: the task, policy or split does not exist.
        OptionError: a value is out of range, the split is held out, or does not belong to the task.
    """
    check_name("task", task, (*TASKS, POINT))
    point = task == POINT
    policy = policy or DEFAULT_POLICY.get(task, "stack")
    check_name("expert (a built-in policy)", policy, BUILT_IN)
    sensors = values.get("sensors", "lidar")
    check_name("sensors", sensors, get_args(Sensors))
    if level is not None and (point or level not in (1, 2, 3)):
        raise OptionError(
            f"level is {level}, expected 1, 2 or 3" + (": only tasks of LabNav have levels" if point else "")
        )
    split = split or ("train" if point else "floors-train")
    check_split(split, point)
    if point and BUILT_IN[policy].sees == "world":
        raise OptionError(f"policy {policy!r} foresees the world, which only tasks of LabNav hand out; use astar")
    for name, least, most in (("episodes", 1, 1_000_000), ("shard", 1, 10_000), ("seed", 0, 2**53 - 1)):
        if not least <= values.get(name, least) <= most:
            raise OptionError(f"{name} is {values[name]}, expected {least} to {most}")
    return DriveOptions(task=task, policy=policy, split=split, level=1 if point else level or 2, **values)


def check_split(split: str, rooms: bool) -> None:
    """Refuse splits that are held out, and rooms for tasks of LabNav.

    Args:
        rooms: whether the task also takes place in the rooms of "train" and "val".

    Raises:
        OptionError: nothing may be trained on the split, or the task does not take place there.
        UnknownNameError: there is no such split.
    """
    allowed = SPLITS if rooms else tuple(name for name in SPLITS if name not in ROOM_SPLITS)
    if split in ("test", "floors-test", "floors-seen"):
        raise OptionError(f"split {split!r} is held out for tests and must not be trained on: use {', '.join(allowed)}")
    if split not in SPLITS:
        raise UnknownNameError("split", split, allowed)
    if split not in allowed:
        raise OptionError(
            f"split {split!r} has single rooms, and tasks of LabNav need floors: use {', '.join(allowed)}"
        )
