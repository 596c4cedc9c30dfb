"""The check of a submission: whether somebody's result can be trusted."""

from __future__ import annotations

import math
import secrets
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.eval.driving.files import SUMMARY
from labgym.eval.driving.record import EvaluationSummary
from labgym.eval.driving.runner import policy_fingerprint
from labgym.eval.labnav.evaluation import is_labnav_run
from labgym.eval.labnav.foresight import in_place
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.submission.claim import Claim, Verdict, completeness_problems, listed
from labgym.eval.submission.labnav_claim import LabNavClaim
from labgym.eval.submission.record_checks import RunRecord, run_problems
from labgym.eval.submission.transition_claim import TransitionClaim
from labgym.policies import Policy
from labgym.policies.kernels import kernel_mode
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.policies.process.box import BUILT_IN_CODE, NOT_BOXED, UNRANKED, is_rankable
from labgym.policies.registry import BUILT_IN


@dataclass(frozen=True)
class PolicyChoice:
    """The policy that drives again.

    Attributes:
        name: for `make_policy`.
        options: its arguments.
        passed: whether the user passed the policy; otherwise it is the built-in one that the submission names.
    """

    name: str
    options: dict[str, Any] = field(default_factory=dict)
    passed: bool = False

    @classmethod
    def of(cls, summary: EvaluationSummary, name: str | None, options: Mapping[str, Any] | None) -> PolicyChoice:
        """Return the policy that the user passed, or else the built-in one that a submission names.

        A submission cannot choose a class, a file or a server: only built-in names are taken from it, and only
        options that are numbers and switches.

        Raises:
            OptionError: the policy of the submission is not built in, or has options that are not taken from it.
        """
        remedy = "pass the policy with --policy and --options, or check without driving with --no-drive"
        if name is not None:
            if summary.options and not options:
                raise OptionError(
                    f"the submission drove with options {_shown(summary.options)}: pass them with --options"
                )
            return cls(name, dict(options or {}), passed=True)
        if summary.policy not in BUILT_IN:
            raise OptionError(f"policy {summary.policy[:80]!r} of the submission is not built in; {remedy}")
        unsafe = sorted(key for key, value in summary.options.items() if not _is_plain(value))
        if unsafe:
            raise OptionError(f"option {unsafe[0][:80]!r} of the submission is not a number or a switch; {remedy}")
        return cls(summary.policy, dict(summary.options))

    @property
    def source(self) -> PolicySource:
        """The policy, for a separate process."""
        return PolicySource.named(self.name, self.options)

    def problems(
        self, policy: PolicyProcess, stated: Mapping[str, tuple[object, object]], label: str, record: RunRecord
    ) -> Iterator[str]:
        """Yield a sentence for each way in which the policy is not the one that the submission names.

        Args:
            policy: in its process. stated: properties of it, and what the submission says of them.
            label: of the policy in the submission. record: of the run.
        """
        for name, (value, claimed) in stated.items():
            if value != claimed:
                yield f"{name} of the policy is {value!r}, the submission says {claimed!r}"
        if record.identity is None:
            return
        expected = policy_fingerprint(self.name, self.source, label, policy.files()).model_dump()
        stated_policy = record.identity.inputs.get("policy")
        differing = [
            name
            for name in expected
            if not isinstance(stated_policy, dict) or stated_policy.get(name) != expected[name]
        ]
        if differing:
            yield f"the policy's {', '.join(differing)} differ from those in the submission's identity"


def _is_plain(value: object) -> bool:
    """Return whether a value is a number, a switch, None, or a mapping of such values."""
    if isinstance(value, dict):
        return all(not isinstance(item, dict) and _is_plain(item) for item in value.values())
    return value is None or isinstance(value, bool | int | float)


def _shown(options: Mapping[str, Any]) -> str:
    return ", ".join(f"{key}={value}" for key, value in options.items())[:200]


FEWEST = 60
"""All episodes of a result with at most this many are driven again."""
FOREIGN = 0.02
"""Share of the rows: if their actions are not the policy's, one is found by driving again, with the probability
`CAUGHT` at least."""
CAUGHT = 0.99


def check_submission(
    folder: str | Path,
    seed: int | None = None,
    suite: str | LabNavSuite | None = None,
    policy: str | None = None,
    *,
    options: Mapping[str, Any] | None = None,
    drive: bool = True,
    other_code: bool = False,
    progress: bool = True,
) -> Verdict:
    """Check the folder of an evaluation that somebody else made.

    Nothing in the folder is executed, and no class that it names is imported unless it is built in.

    Args:
        folder: folder written by `evaluate` or `labgym eval`.
        seed: random seed of the episodes that are driven again; by default it is drawn, so that nobody can know it
            in advance.
        suite: name or .json file of the suite, or a suite of LabNav, if it is not the published one of the submission's
            name.
        policy: the policy, as for `make_policy`, if it is not built in. It runs on this machine.
        options: arguments of the policy.
        drive: whether to drive episodes again with the policy: all of at most 60, and of more as many, drawn at
            random, as find one of 2% rows that are not the policy's with a probability of 99%. All are simulated again
            with their actions in any case.
        other_code: accept results of another version of labgym.
        progress: whether to show progress bars.

    Raises:
        DocumentError: the folder holds no evaluation.
        OptionError: `drive` is on, and the policy is not available or the processor cannot run the pinned kernels.
    """
    folder = Path(folder)
    if not (folder / SUMMARY).is_file():
        raise DocumentError(folder, "", f"holds no {SUMMARY}; pass the folder of a finished labgym eval")
    try:
        claim = _claim_of(folder, suite)
    except (DocumentError, UnknownNameError) as error:
        return Verdict((str(error),), ())
    choice = PolicyChoice.of(claim.summary, policy, options) if drive else None
    record = RunRecord.read(folder)
    problems = [
        *run_problems(record, claim.identity_problems(record), other_code),
        *_result_problems(claim, progress),
        *claim.summary_problems(record),
    ]
    count = len(claim.keys)
    facts = [f"{len(claim.rows)} of {count} episodes of suite {claim.suite_name} checked", *claim.facts()]
    facts.append(_box_fact(claim.summary))
    if choice is None:
        facts.append("no episode was driven again (--no-drive): the policy itself is not verified")
        return Verdict(tuple(problems), tuple(facts))
    seed = secrets.randbelow(2**32) if seed is None else seed
    keys = drawn_again(claim.keys, seed)
    # The actions that it handed in are no help.
    source = replace(choice.source, hidden=(str(folder.resolve()),))
    driver = PolicyProcess(source, environment=kernel_mode("pinned").environment)
    try:
        own = driver.box == BUILT_IN_CODE, claim.summary.box == BUILT_IN_CODE
        stated = {**claim.stated(driver), "being labgym's own": own}
        problems += choice.problems(driver, stated, claim.summary.policy, record)
        if measured := claim.measured_again(driver, source, claim.summary.seed):
            (facts if measured[0] else problems).append(measured[1])
        problems += listed(_drive_problems(claim, in_place(driver, source), keys, progress), "episodes")
    finally:
        driver.close()
    facts.append(driven_again(len(keys), count, choice.name, seed))
    if driver.box == NOT_BOXED:
        facts.append("driven again without a box: this is a server's policy, or this kernel has no Landlock")
    return Verdict(tuple(problems), tuple(facts))


def simulated_problems(folder: str | Path, suite: str | LabNavSuite | None = None, progress: bool = True) -> list[str]:
    """Return a line for each problem of the files of an evaluation, and for each episode that its actions do not give.

    Args:
        folder: of the evaluation, or of drives of a person, which no run made.
        suite, progress: as for `check_submission`.

    Raises:
        DocumentError, UnknownNameError: the folder holds no evaluation, or there is no such suite.
    """
    return _result_problems(_claim_of(Path(folder), suite), progress)


def _claim_of(folder: Path, suite: str | LabNavSuite | None) -> Claim[Any, Any]:
    if is_labnav_run(folder):
        return LabNavClaim(folder, suite)
    if isinstance(suite, LabNavSuite):
        raise OptionError(f"{folder} holds no evaluation of LabNav: pass the name of its suite")
    return TransitionClaim(folder, suite)


def _result_problems(claim: Claim[Any, Any], progress: bool) -> list[str]:
    return [
        *listed(claim.file_problems, "problems of files"),
        *claim.suite_problems(),
        *listed(completeness_problems(claim.keys, claim.given, claim.suite_name), "episodes"),
        *listed(_drive_problems(claim, None, claim.keys, progress), "simulated episodes"),
    ]


def _box_fact(summary: EvaluationSummary) -> str:
    """Return the sentence of a verdict on the box in which the submission drove."""
    if not is_rankable(summary.box):
        return f"{summary.policy[:80]} is {UNRANKED}"
    return f"box: {summary.box}"


def _drive_problems(
    claim: Claim[Any, Any], policy: PolicyProcess | Policy | None, keys: Sequence[str], progress: bool
) -> Iterator[str]:
    """Drive episodes again, or simulate them without a policy, and yield a sentence for each that differs."""
    name = "simulate   " if policy is None else "drive again"
    for key in tqdm(keys, desc=name, unit="ep", disable=not progress):
        difference = claim.simulated(key) if policy is None else claim.driven_again(policy, key)
        if difference:
            yield difference


def drawn_again(keys: Sequence[str], seed: int) -> tuple[str, ...]:
    """Return the keys of the episodes that are driven again, in their order, drawn at random."""
    count = sample_size(len(keys))
    chosen = np.random.default_rng(seed).choice(len(keys), size=count, replace=False)
    return tuple(keys[index] for index in sorted(chosen.tolist()))


def sample_size(episodes: int) -> int:
    """Return how many of some episodes are driven again: all of at most 60, of more as many as `CAUGHT` needs."""
    if episodes <= FEWEST:
        return episodes
    return next(again for again in range(episodes + 1) if unseen(episodes, again) <= 1.0 - CAUGHT + 1e-12)


def foreign_rows(episodes: int) -> int:
    """Return the number of rows that are `FOREIGN` of some episodes, rounded down, at least 1."""
    return max(1, int(FOREIGN * episodes + 1e-9))


def unseen(episodes: int, again: int) -> float:
    """Return the probability that none of `foreign_rows` is among the episodes that are driven again.

    It is that of the hypergeometric distribution: of drawing without replacement.

    Args:
        episodes: number of all. again: number of those that are driven again.
    """
    return math.comb(episodes - foreign_rows(episodes), again) / math.comb(episodes, again)


def driven_again(again: int, episodes: int, policy: str, seed: int) -> str:
    """Return the sentence of a verdict on the episodes that were driven again."""
    if again == episodes:
        return f"all {again} episodes driven again with {policy!r}"
    caught = math.floor(1000.0 * (1.0 - unseen(episodes, again))) / 10.0
    return (
        f"{again} of {episodes} episodes driven again with {policy!r}, chosen with --seed {seed}: if the actions of "
        f"{foreign_rows(episodes)} rows (2%) are not the policy's, one is found with a probability of {caught:g}%"
    )
