"""Types of command-line arguments, with how `--help` shows them."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import OmitArgPrefixes, Positional, arg

from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.layouts.rules import RuleSet
    from labgym.runs import ExecutorOptions


LayoutName = Positional[Annotated[str, arg(metavar="LAYOUT")]]
"""A layout's .json file, or the id of a published layout."""

LayoutNames = Positional[
    Annotated[tuple[str, ...], arg(metavar="LAYOUT [LAYOUT ...]", help_behavior_hint="(required)")]
]
"""One or more layouts, as `LayoutName`, or folders of layouts."""

ProtocolName = Positional[Annotated[str, arg(metavar="PROTOCOL")]]
"""A protocol's .json file, or the id of a protocol of the library."""

ProtocolNames = Positional[
    Annotated[tuple[str, ...], arg(metavar="PROTOCOL [PROTOCOL ...]", help_behavior_hint="(required)")]
]
"""One or more protocols, as `ProtocolName`."""

OptionalText = Annotated[str | None, arg(metavar="STR", help_behavior_hint="")]
OptionalWholeNumber = Annotated[int | None, arg(metavar="INT", help_behavior_hint="")]
OptionalNumber = Annotated[float | None, arg(metavar="FLOAT", help_behavior_hint="")]
OptionalPath = Annotated[Path | None, arg(metavar="PATH", help_behavior_hint="")]
Texts = Annotated[tuple[str, ...], arg(metavar="STR [STR ...]", help_behavior_hint="")]
PolicyOptions = Annotated[tuple[str, ...], arg(metavar="NAME=VALUE [...]", help_behavior_hint="")]
Folders = Positional[Annotated[tuple[Path, ...], arg(metavar="FOLDER [FOLDER ...]", help_behavior_hint="(required)")]]


def numbers(name: str, text: str | None) -> tuple[float, ...] | None:
    """Return the numbers in a text such as 1.5,2,0; None for None.

    Raises:
        OptionError: a part of the text is not a number.
    """
    if text is None:
        return None
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise OptionError(f"--{name} {text[:60]!r} must be numbers with commas between them, such as 1.5,2,0") from None


def sized(size: tuple[int | None, int | None], default: tuple[int, int]) -> tuple[int, int]:
    """Return width and height in pixels: those asked for, else those by default."""
    width, height = size
    return default[0] if width is None else width, default[1] if height is None else height


@dataclass(frozen=True)
class ExecutorArguments:
    """Arguments of the commands whose work may run on other processes or machines.

    Attributes:
        workers: Number of processes, or of Slurm jobs at a time; the files do not depend on it.
        executor: Where the work runs: local processes, the Dask cluster of --scheduler, or Slurm jobs (docs/scale.md).
        scheduler: Address of the Dask scheduler, such as tcp://127.0.0.1:8786.
        slurm: Parameters of the Slurm jobs by submitit's names, such as slurm_partition=cpu timeout_min=60.
    """

    workers: int = 1
    executor: Literal["local", "dask", "slurm"] = "local"
    scheduler: OptionalText = None
    slurm: PolicyOptions = ()

    def options(self) -> ExecutorOptions:
        """Return the options of the executor.

        Raises:
            OptionError: they are out of range, or belong to another executor.
        """
        from labgym.runs import ExecutorOptions

        return ExecutorOptions(self.executor, self.workers, self.scheduler, parse_options(self.slurm))


@dataclass(frozen=True)
class RuleArguments:
    """Rules that a layout satisfies.

    Attributes:
        profile: Thresholds to satisfy: default, strict, paper, or code (default, and a second exit is required).
        rules: Rule set to satisfy: touchstone, under which missing safety equipment is added, too, or paper.
    """

    profile: str = "default"
    rules: str = "touchstone"

    def rule_set(self) -> RuleSet:
        """Return the rule set with the thresholds.

        Raises:
            UnknownNameError: no rule set or no profile has that name.
        """
        from labgym.layouts.rules import rule_set

        return rule_set(self.rules, self.profile)


DEFAULT_RULES = RuleArguments()


def parse_options(texts: Iterable[str]) -> dict[str, Any]:
    """Return arguments by name from texts NAME=VALUE; a value that is valid JSON is read as JSON.

    Raises:
        OptionError: a text has no name.
    """
    arguments: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.isidentifier():
            raise OptionError(f"option {text[:80]!r} is not NAME=VALUE, such as replan=2")
        try:
            arguments[name] = json.loads(value)
        except (ValueError, RecursionError):
            arguments[name] = value
    return arguments


Execution = OmitArgPrefixes[ExecutorArguments]
"""The arguments --workers, --executor, --scheduler and --slurm."""
THIS_PROCESS = ExecutorArguments()


def allow_local_modules() -> None:
    """Let `--policy module:Class` name modules of the working folder, which the policy's process imports."""
    from labgym.policies.fingerprint.sources import MODULES

    os.environ[MODULES] = str(Path.cwd())
