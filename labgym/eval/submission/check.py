"""The check of a submission: whether somebody's result can be trusted."""

from __future__ import annotations

import itertools
import secrets
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from labgym.envs.world import world_of
from labgym.errors import DocumentError, UnknownNameError
from labgym.eval.driving.assignments import assignments
from labgym.eval.driving.episode_row import Key
from labgym.eval.driving.files import SUMMARY
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.labnav.evaluation import is_labnav_run
from labgym.eval.submission.folder import Episodes, episode_name
from labgym.eval.submission.labnav_check import check_labnav
from labgym.eval.submission.published import Published, suite_problems
from labgym.eval.submission.record_checks import RunRecord, record_problems, summary_problems
from labgym.eval.submission.route_checks import lab30_route_problems
from labgym.eval.submission.row_checks import Terms, row_problems
from labgym.eval.submission.second_drive import drive_problems, driven_again, sampled
from labgym.eval.submission.submitted_policy import PolicyChoice
from labgym.eval.submission.verdict import Verdict, completeness_problems, listed
from labgym.policies.kernels import kernel_mode
from labgym.policies.process import PolicyProcess


def check_submission(
    folder: str | Path,
    seed: int | None = None,
    suite: str | None = None,
    policy: str | None = None,
    options: Mapping[str, Any] | None = None,
    drive: bool = True,
    other_code: bool = False,
    progress: bool = True,
) -> Verdict:
    """Check the folder of an evaluation that somebody else made.

    Nothing in the folder is executed, and no class that it names is imported unless it is built in.

    Args:
        folder: folder written by `evaluate`, `evaluate_labnav` or `labgym eval`.
        seed: random seed of the episodes that are driven again; by default it is drawn, so that nobody can know it
            in advance.
        suite: name or .json file of the suite, if it is not the published one of the submission's name.
        policy: the policy, as for `make_policy`, if it is not built in. It runs on this machine.
        options: arguments of the policy.
        drive: whether to drive episodes again: all of at most 60, and a random tenth, but at least 60, of more.
        other_code: accept results of another version of labgym.
        progress: whether to show progress bars.

    Raises:
        DocumentError: the folder holds no evaluation.
        OptionError: `drive` is on, and the policy is not available or the processor cannot run the pinned kernels.
    """
    folder = Path(folder)
    if not (folder / SUMMARY).is_file():
        raise DocumentError(folder, "", f"holds no {SUMMARY}; pass the folder of a finished labgym eval")
    if is_labnav_run(folder):
        return check_labnav(folder, seed, suite, policy, options, drive, other_code, progress)
    try:
        summary = NavigationSummary.load(folder / SUMMARY)
        published = Published.of(summary.suite, suite)
    except (DocumentError, UnknownNameError) as error:
        return Verdict((str(error),), ())
    choice = PolicyChoice.of(summary, policy, options) if drive else None
    terms = Terms(published.suite, summary.policy, summary.seed)
    record = RunRecord.read(folder)
    episodes = Episodes.read(folder, published.episodes)
    problems = [
        *record_problems(record, summary, published, other_code),
        *suite_problems(summary.suite, published.suite),
        *listed(episodes.problems, "problems of files"),
        *listed(
            completeness_problems(
                itertools.chain.from_iterable(published.keys.values()),
                episodes.rows,
                episodes.routes,
                published.suite.label,
                episode_name,
            ),
            "episodes",
        ),
        *listed(_episode_problems(episodes, published, terms), "problems of episodes"),
        *summary_problems(summary, tuple(episodes.rows.values()), published, exactly=record.code_is_present),
    ]
    facts = [f"{len(episodes.rows)} of {published.episodes} episodes of suite {published.suite.label} checked"]
    if choice is None:
        facts.append("no episode was driven again (--no-drive): the policy itself is not verified")
        return Verdict(tuple(problems), tuple(facts))
    seed = secrets.randbelow(2**32) if seed is None else seed
    keys = sampled(published, seed)
    driver = PolicyProcess(choice.source, environment=kernel_mode("pinned").environment)
    try:
        stated = {
            "privileged": (driver.privileged, summary.privileged),
            "sensors": (driver.observation, summary.sensors),
        }
        problems += choice.problems(driver, stated, summary.policy, record)
        problems += listed(drive_problems(driver, keys, published, episodes, terms, progress), "episodes")
    finally:
        driver.close()
    facts.append(driven_again(len(keys), published.episodes, choice.name, seed))
    return Verdict(tuple(problems), tuple(facts))


def _episode_problems(episodes: Episodes, published: Published, terms: Terms) -> Iterator[str]:
    for name, layout in published.layouts.items():
        keys = [key for key in published.keys[name] if key in episodes.rows]
        if not keys:
            continue
        world = world_of(layout)
        for episode in assignments(layout, terms.suite):
            key: Key = (name, episode.pair.index, episode.repeat)
            if key not in episodes.rows:
                continue
            row = episodes.rows[key]
            problems = list(row_problems(row, episode, layout, world, terms))
            if key in episodes.routes:
                problems += lab30_route_problems(row, episodes.route(key), terms.suite, world)
            yield from (f"episode {episode_name(key)}: {problem}" for problem in problems)
