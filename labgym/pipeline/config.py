"""Options of `labgym run`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from labgym.errors import MissingDependencyError, OptionError

SHOWN = ("astar", "online_map", "navdp", "iplanner", "ppo", "straight")
"""Policies that a run evaluates by default."""
LABNAV = ("blind", "bug2", "astar", "online_map", "ppo", "stack")
"""Policies that drive the small suite of LabNav by default."""

_Text = Annotated[str | None, arg(metavar="STR", help_behavior_hint="")]
_Texts = Annotated[tuple[str, ...], arg(metavar="STR [STR ...]", help_behavior_hint="")]


@dataclass(frozen=True)
class RunConfig:
    """Options of a run.

    Attributes:
        name: Name of the run, which is written to runs/NAME; by default "default", or "seed-SEED" with a seed.
        out: Folder to write to instead of runs/NAME.
        seed: Random seed for 30 new layouts; by default the published test layouts are used.
        protocols: Ids or, with --seed, .json files of the protocols; by default all 30 of the library.
        profile: Thresholds of generation and scores: default, strict or paper.
        policies: Policies to evaluate, in the order of the table; by default astar, online_map, navdp, iplanner, ppo
            and straight, except those whose dependencies are not installed.
        workers: Number of processes; 0 uses all cores.
        views: Number of layouts that are also rendered.
        full: Drive every goal pair of the layouts instead of the first one of each.
        fresh: Rename the folder to NAME.old-1 and so on, and start anew.
    """

    name: _Text = None
    out: Annotated[Path | None, arg(metavar="PATH", help_behavior_hint="")] = None
    seed: Annotated[int | None, arg(metavar="INT", help_behavior_hint="")] = None
    protocols: _Texts = ()
    profile: str = "default"
    policies: _Texts = ()
    workers: int = 0
    views: int = 6
    full: bool = False
    fresh: bool = False

    @property
    def folder(self) -> Path:
        """Folder that the run is written to."""
        name = self.name or ("default" if self.seed is None else f"seed-{self.seed}")
        return self.out if self.out is not None else Path("runs") / name

    @property
    def processes(self) -> int:
        """Number of worker processes."""
        return self.workers or len(os.sched_getaffinity(0))

    @property
    def labnav(self) -> bool:
        """Whether the run drives the small suite of LabNav: if it shows the published layouts, all of them."""
        return self.seed is None and not self.protocols

    def runnable(self, default: Sequence[str] = SHOWN) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the policies to evaluate, and for each default policy that is left out the reason."""
        from labgym.policies import make_policy

        if self.policies:
            return self.policies, ()
        installed, reasons = [], []
        for policy in default:
            try:
                make_policy(policy).close()
                installed.append(policy)
            except MissingDependencyError as error:
                reasons.append(str(error))
        return tuple(installed), tuple(reasons)

    def check(self) -> None:
        """Check numbers and names.

        Raises:
            OptionError: a number is negative, or a policy is repeated.
            UnknownNameError: a profile, a protocol or a policy does not exist.
        """
        from labgym.layouts.rules.thresholds import profile
        from labgym.policies.process import PolicyProcess, PolicySource
        from labgym.protocols import resolve

        if self.workers < 0 or self.views < 0:
            raise OptionError(f"workers ({self.workers}) and views ({self.views}) must not be negative")
        if len(set(self.policies)) != len(self.policies):
            raise OptionError(f"policies {list(self.policies)} name a policy twice; name each policy once")
        profile(self.profile)
        for protocol in self.protocols:
            resolve(protocol)
        for policy in self.policies:
            PolicyProcess(PolicySource.named(policy)).close()
