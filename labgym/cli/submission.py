"""`labgym submit`: folder and text of a submission, and the check of results that others submit."""

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

SUBMISSIONS = Path("submissions")
"""Folder of a checkout in which a pull request brings results."""
PULL_REQUEST = """\
**Policy**: {policy} - one sentence on how it works

**Code and weights**: {code}

**Track**: {track}

**Command**:

```
labgym eval --policy {named} --suite {suite} --seed {seed}
```

**Figure**:

{table}

**Training**: floors, splits and other data that the policy was trained or tuned on

- [ ] the folder of `labgym eval` is in `{folder}`, complete and unedited
- [ ] `labgym submit check {folder}` passes here{extra}
- [ ] the policy was neither trained nor tuned on `floors-test`, `floors-sealed` or the suite
- [ ] the row may be published under Apache-2.0
"""


def pack(folder: Annotated[Positional[Path], arg(metavar="FOLDER")], out: OptionalPath = None) -> int:
    """Write the folder of a submission, and the text of its pull request next to it.

    Copies the files that labgym eval wrote, without reports and films. Exit 1 if they contradict each other.

    Args:
        folder: Folder written by labgym eval.
        out: Folder of the submission; by default submissions/NAME of the evaluation's folder.
    """
    import shutil

    from labgym.documents import write_text
    from labgym.errors import DocumentError, OptionError
    from labgym.eval import read_evaluation
    from labgym.eval.labnav.evaluation import LabNavEvaluation
    from labgym.eval.reports.tables import evaluation_table
    from labgym.policies.registry import BUILT_IN
    from labgym.runs.manifest import MANIFEST_FILE, RunManifest

    evaluation = read_evaluation(folder)
    manifest = RunManifest.read(folder)
    if manifest is None:
        raise DocumentError(folder, MANIFEST_FILE, "missing: only a finished evaluation can be submitted")
    if evaluation.problems:
        return complaints(evaluation.problems)
    manifest.check(folder)
    out = SUBMISSIONS / folder.resolve().name if out is None else out
    if out.exists():
        raise OptionError(f"{out} exists: name another folder with --out, or remove it")
    out.mkdir(parents=True)
    for path in sorted(folder.iterdir()):
        if path.suffix in (".json", ".jsonl") and path.is_file():
            shutil.copyfile(path, out / path.name)
    summary = evaluation.summary
    known = summary.policy in BUILT_IN
    if isinstance(evaluation, LabNavEvaluation):
        track, suite = str(evaluation.summary.track), evaluation.summary.suite
    else:
        track, suite = "-", evaluation.summary.suite.label
    text = out.with_name(f"{out.name}.md")
    write_text(
        text,
        PULL_REQUEST.format(
            policy=summary.policy,
            code="built in" if known else "where they are, with commit and license",
            track=track,
            named=summary.policy if known else "module:Class",
            suite=suite,
            seed=summary.seed,
            table=evaluation_table(evaluation).markdown(),
            folder=out.as_posix(),
            extra="" if known else ", with --policy",
        ),
    )
    written(out)
    return written(text)


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
