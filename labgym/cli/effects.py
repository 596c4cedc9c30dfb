"""Flags of the commands that other flags leave without effect, as one table; passing one is an error in one line."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from functools import wraps
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from labgym.errors import refuse_idle

EXECUTION = ("workers", "executor", "scheduler", "slurm")
DRIVES = ("task", "level", "split", "policy", "sensors", "episodes", "successful")
RENAMED = {"as_json": "json"}
"""Flags that are not called as their parameters."""


@dataclass(frozen=True)
class Idle:
    """Flags without effect.

    Attributes:
        flags: parameters of the command.
        when: returns whether they have no effect, from the values of all parameters.
        reason: why, and the remedy; follows "--FLAG has no effect".
    """

    flags: tuple[str, ...]
    when: Callable[[Any], bool]
    reason: str


def _labnav_suite(values: Any) -> bool:
    from labgym.eval.labnav.suites import is_labnav

    return is_labnav(values.suite)


def _labnav_folders(values: Any) -> bool:
    from labgym.eval.labnav.evaluation import is_labnav_run

    return bool(values.folders) and all(is_labnav_run(folder) for folder in values.folders)


def _episodes(values: Any) -> bool:
    """Return whether `labgym record` films an episode of a folder or a suite, which has its own start and goal."""
    from labgym.eval.labnav.suites import is_labnav

    return Path(values.layout).is_dir() or is_labnav(values.layout)


def _names_level(values: Any) -> bool:
    return bool(values.task) and values.task[-1].isdigit()


def _trace(values: Any) -> bool:
    from labgym.cli.traces import is_trace

    return is_trace(values.source)


def _replaced_suite(values: Any) -> bool:
    return bool(values.layouts) and not str(values.suite).endswith(".json") and not _labnav_suite(values)


def _single(names: Any, out: object = None) -> bool:
    return len(names) == 1 and out is None and not Path(names[0]).is_dir()


NO_BATCH = "for a single layout: add --count, or leave it out"
BATCH = "with --count: it is for a single layout"
NO_OUT = "without --out, which names the folder"
OWN_EPISODES = "on an episode of a folder or a suite, which has its own: it is for a layout"
PICTURE = "here: only --web drives a policy"

IDLE: Mapping[str, tuple[Idle, ...]] = {
    "bench": (
        Idle(("rounds",), lambda v: v.growth, "with --growth: leave it out"),
        Idle(("rounds", "growth"), lambda v: v.thinking, "with --thinking: leave it out"),
    ),
    "generate": (
        Idle(("explain", "have", "only_have", "extra", "fixed", "service", "trace"), lambda v: v.count, BATCH),
        Idle(("overwrite",), lambda v: v.count, "with --count, which resumes: start anew with --fresh"),
        Idle(("shard", "fresh", *EXECUTION), lambda v: v.count is None, NO_BATCH),
        Idle(("only_have", "extra"), lambda v: v.have is None, "without an inventory: name it with --have"),
        Idle(
            ("explain",),
            lambda v: v.proposer != "solver",
            "with another --proposer: it gives the reasons of the solver",
        ),
        Idle(("adjuster",), lambda v: not v.optimise, "with --no-optimise, which adjusts nothing"),
        Idle(("library",), lambda v: v.rules != "labbuilder", "without --rules labbuilder: leave it out"),
        Idle(
            ("profile", "explain", "trace", "count"),
            lambda v: v.rules == "labbuilder",
            "with --rules labbuilder, which has its own distances and chooses among several layouts: leave it out",
        ),
    ),
    "score": (
        Idle(
            ("protocol", "profile", "rules", "library", "out", "judge", "samples", "fresh", *EXECUTION),
            lambda v: v.regulations is not None,
            "with --regulations, which prints the clauses of one layout: leave one of them out",
        ),
        Idle(("library",), lambda v: v.rules != "labbuilder", "without --rules labbuilder: leave it out"),
        Idle(
            ("protocol", "profile", "check", "out", "samples", "fresh", *EXECUTION),
            lambda v: v.rules == "labbuilder",
            "with --rules labbuilder, which prints the figures of both modes: leave it out",
        ),
        Idle(
            ("library",),
            lambda v: v.rules == "labbuilder" and v.judge,
            "with --rules labbuilder --judge, which prints points as JSON: leave it out",
        ),
        Idle(("fresh",), lambda v: v.out is None, NO_OUT),
        Idle(("samples",), lambda v: v.judge is None, "without a judge: name its mode with --judge"),
        Idle(EXECUTION, lambda v: _single(v.layout, v.out), "for a single layout: leave it out"),
    ),
    "compile": (Idle(("loose",), lambda v: not v.interactive, "on a rigid scene: add --interactive"),),
    "view": (
        Idle(("layouts", "suite", "protocol", "camera", "pair"), lambda v: v.task, "with --task, an episode of LabNav"),
        Idle(("level", "episode"), lambda v: v.task is None, "without --task: name a task of LabNav"),
        Idle(("level",), _names_level, "with a --task that names its level"),
        Idle(("out", "camera", "width", "height"), lambda v: v.web, "with --web, which draws no picture"),
        Idle(("suite", "policy", "pair", "options", "port"), lambda v: not v.web, PICTURE),
        Idle(("seed",), lambda v: not v.web and v.task is None, "on the picture of a layout: add --web or --task"),
        Idle(("seed",), lambda v: not v.web and v.episode, "on a published episode: leave out --episode to draw one"),
        Idle(("suite",), _replaced_suite, "with layouts: only the .json file of a suite sets their rules"),
        Idle(
            ("width", "height"),
            lambda v: v.task is None and v.camera == "topdown",
            "on a plan, which has the size of its scale: add --camera overview",
        ),
    ),
    "play": (
        Idle(("protocol", "film"), _labnav_suite, "with a suite of LabNav, which has fixed episodes and no film"),
        Idle(("suite",), _replaced_suite, "with layouts: only the .json file of a suite sets their rules"),
        Idle(("name",), lambda v: v.out is None, NO_OUT),
    ),
    "trace": (Idle(("profile", "protocol", "save"), _trace, "on a trace: it is for layouts"),),
    "eval": (
        Idle(("protocol", "repeats", "jitter"), _labnav_suite, "with a suite of LabNav, which has fixed episodes"),
        Idle(("latency",), lambda v: not _labnav_suite(v), "with this suite, which does not delay actions"),
        Idle(("protocol",), lambda v: not v.layouts, "on a suite, whose layouts embed their protocols: add --layouts"),
        Idle(("suite",), _replaced_suite, "with --layouts: only the .json file of a suite sets their rules"),
    ),
    "report": (Idle(("workers",), _labnav_folders, "on results of LabNav: leave it out"),),
    "record": (
        Idle(("pair", "protocol", "start", "goal"), _episodes, OWN_EPISODES),
        Idle(("pair",), lambda v: v.start and v.goal, "with --start and --goal, which replace both of its ends"),
        Idle(("seed", "options"), lambda v: Path(v.layout).is_dir(), "on a folder, which has its own: leave it out"),
        Idle(
            ("episode",),
            lambda v: not _episodes(v),
            "on a layout: it is for a folder of results or a suite of LabNav",
        ),
        Idle(
            ("width", "height", "quality"),
            lambda v: v.out.suffix == ".mcap",
            "on a recording of ROS 2 messages: it is for films",
        ),
    ),
    "run": (Idle(("name",), lambda v: v.out is not None, "with --out, which names the folder"),),
    "labnav": (
        Idle(
            ("seed",),
            lambda v: v.split in ("floors-sealed", "floors-fresh"),
            "with floors-sealed or floors-fresh, whose secret decides: leave it out",
        ),
        Idle(("unfiltered",), lambda v: 2 not in v.level, "without level 2: leave it out"),
    ),
    "describe splits": (
        Idle(("floors", "own"), lambda v: v.published, "with --published, which describes all published floors"),
        Idle(("seed",), lambda v: v.own or v.published, "with --own or --published, whose seeds are fixed"),
        Idle(("fresh",), lambda v: v.out is None, NO_OUT),
    ),
    "submit check": (
        Idle(("seed",), lambda v: v.no_drive, "with --no-drive, which drives nothing again"),
        Idle(
            ("policy", "options"),
            lambda v: v.no_drive and v.fresh is None,
            "with --no-drive, which drives nothing again",
        ),
        Idle(
            ("secret_file", "out", *EXECUTION),
            lambda v: v.fresh is None,
            "without --fresh, which drives on fresh floors",
        ),
        Idle(("options",), lambda v: v.policy is None, "without --policy: a built-in one has those of the submission"),
    ),
    "leaderboard": (Idle(EXECUTION, lambda v: not v.routes, "without --routes, which drives again"),),
    "data": (
        Idle(("level",), _names_level, "with a --task that names its level"),
        Idle(
            DRIVES,
            lambda v: v.format == "planner",
            "with --format planner: it belongs to drives, --format parquet, minari or lerobot",
        ),
        Idle(
            ("samples", "floors", "learner", "led"),
            lambda v: v.format != "planner",
            "on drives, whose number is --episodes: it belongs to --format planner",
        ),
        Idle(("led",), lambda v: v.learner is None, "without a learner: name it by --learner FOLDER"),
    ),
    "card ppo": (
        Idle(("observation",), lambda v: v.run and v.out, "with --run and --out: it names the folders by default"),
    ),
    "assets show": (
        Idle(("name", "kind"), lambda v: v.check, "with --check, which checks the whole catalog"),
        Idle(("kind",), lambda v: v.name, "with the name of an asset: leave one of them out"),
    ),
    "assets add": (
        Idle(("workers",), lambda v: _single(v.paths), "for a single file: leave it out"),
    ),
    "protocols show": (Idle(("name",), lambda v: v.validate, "with --validate: leave one of them out"),),
    "protocols new": (
        Idle(("repairs",), lambda v: not v.model, "without the language model: add --model"),
        Idle(("model", "keyword_only"), lambda v: v.explain, "with --explain, which only reads: leave one of them out"),
    ),
    "protocols experiments": (
        Idle(("type",), lambda v: v.name, "with the id of an experiment: leave one of them out"),
    ),
    "protocols import": (
        Idle(("product",), lambda v: v.format != "xdl", "with this --format: it belongs to --format xdl"),
    ),
    "protocols filter": (Idle(("overwrite",), lambda v: v.out is None, NO_OUT),),
}  # fmt: skip
"""By command: which of its flags have no effect, and when. A flag that has its default is not checked."""


def refuses_idle_flags(command: str) -> Callable[[Callable[..., int]], Callable[..., int]]:
    """Return a decorator of the function of a command, which refuses flags without effect before the command runs.

    Args:
        command: key of `IDLE`.
    """

    def decorate(function: Callable[..., int]) -> Callable[..., int]:
        signature = inspect.signature(function)

        @wraps(function)
        def checked(*arguments: Any, **keywords: Any) -> int:
            bound = signature.bind(*arguments, **keywords)
            bound.apply_defaults()
            flags = list(_flags(signature, bound.arguments))
            passed = {name: default for name, value, default in flags if value != default}
            seen = SimpleNamespace(**{name: value for name, value, _ in flags})
            refuse_idle(
                (_word(signature, name, passed[name]), bool(idle.when(seen)), idle.reason)
                for idle in IDLE[command]
                for name in idle.flags
                if name in passed
            )
            return function(*arguments, **keywords)

        return checked

    return decorate


def _flags(signature: inspect.Signature, values: Mapping[str, Any]) -> Iterator[tuple[str, Any, Any]]:
    """Yield name, value and default of each parameter, and of each field of those that are data classes."""
    for name, value in values.items():
        if is_dataclass(value):
            yield from ((field.name, getattr(value, field.name), field.default) for field in fields(value))
        else:
            yield name, value, signature.parameters[name].default


def _word(signature: inspect.Signature, name: str, default: object) -> str:
    """Return what the user writes for a parameter: its flag, or its name in capitals if it has none."""
    parameter = signature.parameters.get(name)
    if parameter is not None and str(parameter.annotation).startswith("Positional"):
        return name.upper()
    negated = "no-" if default is True else ""
    return f"--{negated}{RENAMED.get(name, name).replace('_', '-')}"
