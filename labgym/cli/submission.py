"""The command that checks results which others submit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from labgym.cli.arguments import (
    THIS_PROCESS,
    Execution,
    OptionalPath,
    OptionalText,
    OptionalWholeNumber,
    PolicyOptions,
    allow_local_modules,
    parse_options,
)
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.outcome import complaints, written


@refuses_idle_flags("submit check")
def check(
    folder: Annotated[Positional[Path], arg(metavar="FOLDER")],
    *,
    seed: OptionalWholeNumber = None,
    suite: OptionalText = None,
    policy: OptionalText = None,
    options: PolicyOptions = (),
    no_drive: bool = False,
    other_code: bool = False,
    fresh: OptionalWholeNumber = None,
    secret_file: OptionalPath = None,
    out: OptionalPath = None,
    execution: Execution = THIS_PROCESS,
) -> int:
    """Check an evaluation that somebody else made: simulate its actions again, and drive episodes with the policy.

    All episodes are simulated. Of at most 60 episodes all are driven again with the policy, of more as many, drawn at
    random, as find one of 2% rows that are not the policy's with a probability of 99%. With --fresh, a LabNav policy
    whose result passes also drives floors that follow from a secret, which it cannot have seen; a receipt states what
    it scores there.

    Exit 0 if it passes, 1 with a line for each problem, 2 if the folder or the policy is not available.

    Args:
        folder: Folder written by labgym eval.
        seed: Random seed of the episodes that are driven again; by default a new one, which is printed.
        suite: Name or .json file of the suite; by default the published suite of the submission's name.
        policy: The policy, if it is not built in: module:Class, a file or a URL (see labgym eval --help). It runs on
            this machine.
        options: Arguments of the policy, for example radius=0.28.
        no_drive: Drive nothing again with the policy; simulate only. The policy itself is then not verified.
        other_code: Accept results of another version of labgym.
        fresh: Number of fresh floors to drive, 2 episodes of each task on each: 60, or 20 for policies that cost more
            than 4 CPU hours. Exit 1 if the published figure is an alarm.
        secret_file: File of a secret, 64 hexadecimal digits, from which the fresh floors follow; by default that of
            OUT, or a new one.
        out: Folder for secret, fresh floors, drives and receipts; by default FOLDER-fresh. An interrupted command
            resumes. Policies that are checked with one OUT share floors: a round (labgym leaderboard --fresh-round).
    """
    from labgym.eval.submission.check import check_submission

    if policy is not None:
        allow_local_modules()
    verdict = check_submission(
        folder, seed, suite, policy, options=parse_options(options), drive=not no_drive, other_code=other_code
    )
    for fact in verdict.facts:
        print(fact)
    print("passes" if verdict.passed else f"fails: {len(verdict.problems)} problems")
    if fresh is None or not verdict.passed:
        return complaints(verdict.problems)
    from labgym.eval.submission.fresh import check_fresh, receipt_file

    out = folder.with_name(f"{folder.name}-fresh") if out is None else out
    receipt = check_fresh(
        folder,
        fresh,
        out,
        policy,
        options=parse_options(options),
        suite=suite,
        secret_file=secret_file,
        executor=execution.options(),
    )
    print(receipt.sentence)
    written(receipt_file(out, receipt.policy))
    return complaints([receipt.sentence] if receipt.gain.alarm else [])
