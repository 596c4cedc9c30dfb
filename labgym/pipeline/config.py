"""What a run is asked to do."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from labgym.errors import MissingDependencyError, OptionError
from labgym.layouts.rules.thresholds import profile
from labgym.policies import make_policy
from labgym.protocols import get

SHOWN = ("astar", "online_map", "navdp", "iplanner", "ppo", "straight")
"""Policies that a run evaluates unless told otherwise."""


@dataclass(frozen=True)
class RunConfig:
    """What a run does.

    Attributes:
        name: Name of the run; it is written to runs/NAME. By default "default", or "seed-SEED".
        out: Folder to write to, in place of runs/NAME.
        seed: Seed of 30 new layouts; without it the published test layouts are made again from their own seeds.
        protocols: Ids of the protocols to take; none takes all 30.
        profile: Thresholds of generation and scores: default, strict or paper.
        policies: Policies to evaluate, in the order of the table. By default astar, online_map, navdp, iplanner, ppo
            and straight, as far as the packages that they need are installed.
        workers: Processes to use; 0 takes as many as there are cores.
        views: How many layouts are also rendered.
    """

    name: str | None = None
    out: Path | None = None
    seed: int | None = None
    protocols: tuple[str, ...] = ()
    profile: str = "default"
    policies: tuple[str, ...] = ()
    workers: int = 0
    views: int = 6

    @property
    def folder(self) -> Path:
        """Where the run is written."""
        name = self.name or ("default" if self.seed is None else f"seed-{self.seed}")
        return self.out if self.out is not None else Path("runs") / name

    @property
    def processes(self) -> int:
        """How many processes work."""
        return self.workers or len(os.sched_getaffinity(0))

    def runnable(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the policies to evaluate, and why each of those left out of the default is."""
        if self.policies:
            return self.policies, ()
        found, absent = [], []
        for policy in SHOWN:
            try:
                make_policy(policy).close()
                found.append(policy)
            except MissingDependencyError as error:
                absent.append(str(error))
        return tuple(found), tuple(absent)

    def check(self) -> None:
        """Check the numbers and names.

        Raises:
            OptionError: a number is negative, or policies are repeated.
            UnknownNameError: a profile, a protocol or a policy does not exist.
        """
        if self.workers < 0 or self.views < 0:
            raise OptionError(f"workers ({self.workers}) and views ({self.views}) must not be negative")
        if len(set(self.policies)) != len(self.policies):
            raise OptionError(f"policies {list(self.policies)} hold one of them twice")
        profile(self.profile)
        for protocol in self.protocols:
            get(protocol)
        for policy in self.policies:
            make_policy(policy).close()
