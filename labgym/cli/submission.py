"""The command that checks results which others submit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from labgym.cli.arguments import OptionalText, OptionalWholeNumber, PolicyOptions, allow_local_modules, parse_options
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.outcome import complaints


@refuses_idle_flags("submit check")
def check(
    folder: Annotated[Positional[Path], arg(metavar="FOLDER")],
    seed: OptionalWholeNumber = None,
    suite: OptionalText = None,
    policy: OptionalText = None,
    options: PolicyOptions = (),
    no_drive: bool = False,
    other_code: bool = False,
) -> int:
    """Check an evaluation that somebody else made: simulate its actions again, and drive episodes with the policy.

    All episodes are simulated. Of at most 60 episodes all are driven again with the policy, of more as many, drawn at
    random, as find one of 2% rows that are not the policy's with a probability of 99%.

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
    return complaints(verdict.problems)
