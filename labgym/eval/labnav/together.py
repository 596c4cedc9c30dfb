"""Several policies on the same worlds: each floor of a small suite is prepared once and driven by all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from labgym.documents import files_digest
from labgym.envs.labnav.episodes import LabNavEpisodes
from labgym.eval.driving.files import EPISODES, ROUTES, drive_files, short_name
from labgym.eval.driving.runner import (
    catalog_digest,
    installed_catalog,
    open_driver,
    policy_fingerprint,
    policy_process,
    policy_source,
)
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.foresight import executor_for, in_place
from labgym.eval.labnav.results import DriveTerms
from labgym.eval.labnav.suites import LabNavSuite
from labgym.layouts import Layout
from labgym.policies.kernels import kernel_mode
from labgym.policies.process import PolicySource, close_shared_process
from labgym.runs import ExecutorOptions, RunFolder, Shard, ShardOutput, run_shards

FOLDER = "labnav"


@dataclass(frozen=True)
class Entrant:
    """A policy that drives.

    Attributes:
        source: of its process. label: in the rows. files: digest of its files. fingerprint: of all it depends on.
        foresees: whether it receives the world as it is and will be.
    """

    source: PolicySource
    label: str
    files: str
    fingerprint: dict[str, Any]
    foresees: bool = False

    @classmethod
    def of(cls, policy: str) -> Entrant:
        """Return the policy of that name.

        Raises:
            LabgymError: it cannot be loaded.
        """
        source = policy_source(policy, {})
        with open_driver(policy, source, None, kernel_mode(None), isolated=True) as driver:
            files = driver.files()
            label = short_name(source.name)
            fingerprint = policy_fingerprint(policy, source, label, files).model_dump()
            foresees = driver.foresees
        return cls(source, label, files_digest(files), fingerprint, foresees)


def drive_together(
    policies: Sequence[str],
    suite: LabNavSuite,
    folder: RunFolder | None,
    executor: ExecutorOptions,
    seed: int = 0,
    progress: bool = True,
) -> dict[str, dict[str, bytes]]:
    """Drive several policies through a suite and return the content of their files, by label and name.

    The files are `episodes.jsonl` and `routes.jsonl`, in the suite's order.

    Args:
        policies: names for `make_policy`.
        suite: the suite.
        folder: an open run, which keeps finished floors; None writes nothing.
        executor: where floors are driven; by default in this process, or in one worker if a policy foresees.
        seed: random seed of the policies.
        progress: whether to show a progress bar.

    Raises:
        LabgymError: a policy cannot be loaded, or workers died.
    """
    entrants = tuple(map(Entrant.of, policies))
    executor = executor_for(executor, any(one.foresees for one in entrants))
    shards = []
    for part in suite.parts:
        for floor, episodes in part.floors.items():
            layout = part.layout(floor)
            inputs = {
                "suite": suite.hash,
                "policies": [one.fingerprint for one in entrants],
                "seed": seed,
                "catalog": catalog_digest([layout]),
            }
            own = part.model_copy(update={"episodes": episodes, "draws": {}})
            arguments = (entrants, layout, own, seed, suite.seconds)
            size = len(entrants) * len(episodes)
            shards.append(Shard(f"{part.name}/{floor}", drive_all, arguments, size, inputs))
    contents: dict[str, bytes] = {}
    guard = {"catalog": installed_catalog}
    try:
        for _, output in run_shards(shards, folder, executor, "labnav    ", "ep", guard, progress=progress):
            contents |= output.files
    finally:
        close_shared_process()
    return {
        one.label: {
            name: b"".join(contents[f"{FOLDER}/{shard.name}/{one.label}/{name}"] for shard in shards)
            for name in (EPISODES, ROUTES)
        }
        for one in entrants
    }


def drive_all(
    entrants: tuple[Entrant, ...],
    layout: Layout,
    part: LabNavEpisodes,
    seed: int,
    seconds: float,
) -> ShardOutput:
    """Drive the episodes of one floor by all policies and return their rows and routes.

    Args:
        entrants: the policies. layout: the floor. part: its episodes.
        seed: of the policies. seconds: time limit of a drive.
    """
    files: dict[str, bytes] = {}
    kernels = kernel_mode(None).kind
    for one in entrants:
        driver = in_place(policy_process(one.source, one.files, None, kernels, len(entrants)), one.source)
        drives = drive_floor(driver, layout, part.episodes, DriveTerms.of(part, one.label, seed, seconds))
        content = drive_files(drives)
        place = f"{FOLDER}/{part.name}/{layout.id}/{one.label}"
        files |= {f"{place}/{name}": content[name] for name in (EPISODES, ROUTES)}
    return ShardOutput(files)
