"""The published drives: routes and people of some episodes of each published result, for its page."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

from labgym.artefacts import artefacts
from labgym.documents import write_bytes
from labgym.envs.labnav.nuisances import prepared
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.driving.files import read_records, record_line
from labgym.eval.evaluator import evaluate
from labgym.eval.labnav.replay import things_along
from labgym.eval.labnav.shown_drive import ShownDrive
from labgym.eval.labnav.suites import PREFIX, LabNavSuite, load_labnav
from labgym.eval.leaderboard.labnav import LabNavResult, Outcome, agreement
from labgym.runs import ExecutorOptions

FOLDER = "leaderboard/drives"
CLOSE = 0.02
"""Greatest difference of the scores of a drive and of the same drive on another machine, which rounds otherwise."""


@dataclass(frozen=True)
class PublishedDrives:
    """Published drives of a policy.

    Attributes:
        path: the file. count: of drives in it.
        differing: a sentence for each drive that is not near the published one, and not in the file.
    """

    path: Path
    count: int
    differing: tuple[str, ...]


def publish_drives(
    result: LabNavResult, keys: Collection[str], runs: Path, executor: ExecutorOptions, place: Path | None = None
) -> PublishedDrives:
    """Drive episodes of a published result again, and write the routes that end as published, with nearly the score.

    Args:
        result: of a built-in policy. keys: of the episodes; those that it does not have are left out.
        runs: folder for the evaluation, which resumes. executor: where the episodes are driven.
        place: another folder to write to.

    Raises:
        UnknownNameError: the policy is not built in. LabgymError: as `evaluate`.
    """
    summary, outcomes = result.summary, result.by_key
    suite = suite_of_keys(frozenset(keys) & outcomes.keys())
    evaluation = evaluate(
        summary.policy,
        suite,
        out=runs / suite.hash[:12] / summary.policy,
        seed=summary.seed,
        options=summary.options,
        executor=executor,
        latency=summary.latency,
    )
    episodes, shown, others = suite.by_key, [], []
    for row in evaluation.rows:
        if not _is_near(row, outcomes[row.key]):
            others.append(row)
            continue
        part, episode = episodes[row.key]
        task = prepared(part.task, part.level, episode, part.layout(episode.floor))
        things = things_along(evaluation, suite, row.key) if task.pushable else None
        shown.append(ShownDrive.of(row, evaluation.routes[row.key], task, things))
    differing = agreement(others, outcomes, suite.seconds).differing
    path = _path(summary.policy, place)
    write_bytes(path, b"".join(map(record_line, shown)))
    return PublishedDrives(path, len(shown), differing)


def suite_of_keys(keys: Collection[str]) -> LabNavSuite:
    """Return the episodes of the suite labnav that have some keys."""
    parts = (part.only(keys) for part in load_labnav(PREFIX).parts)
    return LabNavSuite(f"{PREFIX}-shown", tuple(part for part in parts if part is not None))


def published_drives(result: LabNavResult, place: Path | None = None) -> dict[str, ShownDrive]:
    """Return the published drives of a result by the episode's key; those of another result are left out.

    Raises:
        DocumentError: the file is broken.
    """
    path = _path(result.summary.policy, place)
    if not path.is_file():
        return {}
    drives = read_records(path, ShownDrive)
    outcomes = result.by_key
    return {key: one for key, one in drives.items() if key in outcomes and _is_near(one, outcomes[key])}


def _path(policy: str, place: Path | None) -> Path:
    return (artefacts("eval") / FOLDER if place is None else place) / f"{policy}.jsonl"


def _is_near(drive: LabNavRow | ShownDrive, outcome: Outcome) -> bool:
    """Whether a drive is, but for rounding, the one with an outcome."""
    return drive.ending == outcome.ending and abs(drive.score - outcome.score) <= CLOSE
