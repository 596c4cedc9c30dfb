"""Driving a submission's policy on fresh floors, which follow from the verifier's own secret."""

from __future__ import annotations

import re
import secrets
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import labgym
from labgym.counts import whole_number
from labgym.envs.labnav.episodes import BENCHMARK, LabNavEpisodes
from labgym.envs.labnav.task import SECONDS
from labgym.envs.labnav.tasks import TASKS
from labgym.errors import DocumentError, OptionError
from labgym.eval.driving.floor_suites import floor_suite, suite_floors
from labgym.eval.evaluator import evaluate
from labgym.eval.labnav.evaluation import LabNavEvaluation, is_labnav_run
from labgym.eval.labnav.gain import FEWEST_FLOORS, gain
from labgym.eval.labnav.publication import Publication, SuiteName, draw_suites
from labgym.eval.labnav.suites import PREFIX, LabNavSuite, load_labnav
from labgym.eval.leaderboard.labnav import DIGITS
from labgym.eval.leaderboard.receipts import (
    ALARM,
    PASSED,
    FreshReceipt,
    published_rounds,
    round_of_secret,
)
from labgym.eval.leaderboard.rounds import RECEIPTS
from labgym.eval.submission.check import PolicyChoice
from labgym.layouts import Layout
from labgym.layouts.sealed import FRESH, SECRET, SECRET_BYTES, SealedFloor, read_secret, secret_hash, write_secret
from labgym.policies.fingerprint.policy import PolicyFingerprint
from labgym.runs import ExecutorOptions, RunIdentity
from labgym.runs.identity import IDENTITY_FILE

PER_FLOOR = 2
"""Episodes of each task on a fresh floor."""
_LABEL = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,79}")


def check_fresh(
    folder: str | Path,
    floors: int,
    out: str | Path,
    policy: str | None = None,
    *,
    options: Mapping[str, Any] | None = None,
    suite: str | None = None,
    secret_file: str | Path | None = None,
    executor: ExecutorOptions | None = None,
    progress: bool = True,
) -> FreshReceipt:
    """Drive the policy of a submission on fresh floors; write the receipt and return it.

    `out` keeps the secret, the floors, the suites and the drives; an interrupted call resumes. Submissions that are
    checked with one `out` share its secret and its floors.

    Args:
        folder: the submission, written by `labgym eval`; it passed `check_submission`.
        floors: number of fresh floors, 2 to 1000.
        out: folder for all files; the receipt is `receipts/POLICY.json` in it.
        policy: the policy, as for `make_policy`, if it is not built in. options: its arguments.
        suite: name of the published suite, if not that of the submission.
        secret_file: file of a secret, 64 hexadecimal digits; by default that of `out`, or a new one.
        executor: where floors are drawn and driven.
        progress: whether to show progress bars.

    Raises:
        DocumentError: the folder holds no evaluation of LabNav.
        OptionError: the submission is not of floors-test, the policy is not available, the secret is public or another
            than that of `out`, or `out` holds drives of another policy of that name.
    """
    folder, out, executor = Path(folder), Path(out), executor or ExecutorOptions()
    whole_number("fresh floors", floors, FEWEST_FLOORS, 1000)
    if not is_labnav_run(folder):
        raise DocumentError(folder, "", "holds no evaluation of LabNav: fresh floors are drawn for its tasks")
    published = LabNavEvaluation.read(folder)
    summary = published.summary
    if _LABEL.fullmatch(summary.policy) is None:
        raise OptionError(f"policy {summary.policy[:80]!r}: its label is no name of a file")
    choice = PolicyChoice.of(summary, policy, options)
    chosen = benchmark_suite(suite or summary.suite)
    secret = secret_of(out, secret_file)
    layouts = fresh_floors(secret, floors, out, executor, progress)
    drawn = draw_fresh(chosen, secret, layouts, out, executor, progress)
    drives = out / "drives" / summary.policy
    evaluate(
        choice.name,
        drawn,
        seed=summary.seed,
        latency=summary.latency,
        out=drives,
        options=choice.options,
        executor=executor,
        progress=progress,
    )
    fresh, identity = LabNavEvaluation.read(drives), RunIdentity.load(drives / IDENTITY_FILE)
    # A submission without an identity fails `check_submission`.
    claimed = published.identity
    if claimed is not None and claimed.inputs.get("policy") != identity.inputs["policy"]:
        raise OptionError(
            f"the policy that drives fresh floors is not that of {folder}: its code, options or files differ; pass "
            f"those of the submission, and remove {drives}"
        )
    ours, theirs = ({key: round(score, DIGITS) for key, score in one.scores.items()} for one in (published, fresh))
    difference = gain(ours, theirs)
    receipt = FreshReceipt(
        secret=secret_hash(secret),
        floors=tuple(SealedFloor(id=layout.id, hash=layout.hash) for layout in layouts),
        per_floor=PER_FLOOR,
        fingerprint=PolicyFingerprint.model_validate(identity.inputs["policy"]),
        labgym=labgym.__version__,
        code=identity.code,
        suite=summary.suite,
        episodes=summary.hash,
        figure=summary.labnav,
        summary=fresh.summary,
        scores=theirs,
        gain=difference,
        verdict=ALARM if difference.alarm else PASSED,
    )
    receipt.save(receipt_file(out, summary.policy))
    return receipt


def receipt_file(out: Path, policy: str) -> Path:
    """Return the path of the receipt of a policy."""
    return out / RECEIPTS / f"{policy}.json"


def secret_of(out: Path, secret_file: str | Path | None) -> bytes:
    """Return the secret of a folder: that of a file, or the one that it has, or a new one; the folder keeps it.

    Raises:
        DocumentError: a file holds no secret.
        OptionError: the folder has another secret, or the secret is published.
    """
    own = out / SECRET
    secret = read_secret(own) if own.is_file() else None
    if secret_file is not None and secret not in (None, read_secret(secret_file)):
        raise OptionError(
            f"{out} has another secret than {secret_file}: leave out --secret-file, or pass another --out"
        )
    if secret is None:
        secret = secrets.token_bytes(SECRET_BYTES) if secret_file is None else read_secret(secret_file)
        write_secret(own, secret)
    if public := round_of_secret(secret_hash(secret), published_rounds()):
        raise OptionError(f"the secret of {out} is public since round {public}: pass another --out")
    return secret


def benchmark_suite(name: str) -> LabNavSuite:
    """Return a published suite with which fresh floors are compared.

    Raises:
        UnknownNameError: there is no such suite.
        OptionError: it is not one of whole drives on floors-test.
    """
    suite = load_labnav(name)
    if suite.seconds != SECONDS or any(part.split != BENCHMARK or not part.filtered for part in suite.parts):
        raise OptionError(
            f"suite {name} is not compared with fresh floors: hand in one of {PREFIX}, or {PREFIX}-TASK, on {BENCHMARK}"
        )
    return suite


def fresh_floors(
    secret: bytes, floors: int, out: Path, executor: ExecutorOptions, progress: bool
) -> tuple[Layout, ...]:
    """Return floors that follow from a secret, drawn into the folder `out`; the first ones do not depend on `floors`.

    Args:
        secret: 32 bytes. floors: number of floors. executor: where they are drawn. progress: show a progress bar.
    """
    own = _floor_folder(out, floors)
    suite = floor_suite(FRESH, floors, own, episodes=1, secret=secret, executor=executor, progress=progress)
    return suite_floors(suite, own)


def draw_fresh(
    suite: LabNavSuite, secret: bytes, layouts: Sequence[Layout], out: Path, executor: ExecutorOptions, progress: bool
) -> LabNavSuite:
    """Return fresh episodes of the tasks of a published suite, on floors that follow from a secret.

    They are those of `labgym floors` and `labgym labnav` with the split floors-fresh and the same secret. A floor has
    two episodes of a task or none: fewer floors than asked for may have those of a task.

    Args:
        suite: the published suite. secret: 32 bytes. layouts: its floors, as `fresh_floors` draws them into `out`.
        executor: where they are drawn. progress: whether to show progress bars.
    """
    floors = len(layouts)
    levels, tasks = {part.level for part in suite.parts}, [part.task for part in suite.parts]
    names = [] if set(tasks) == set(TASKS) else tasks
    folder = out / "-".join(["suites", str(floors), *map(str, sorted(levels)), *names])
    publication = Publication(
        FRESH,
        floors,
        PER_FLOOR,
        tuple(tasks),
        tuple(sorted(levels)),
        unfiltered=False,
        version=suite.parts[0].version,
        draft=suite.draft,
        secret=secret,
        layouts=_floor_folder(out, floors) / "layouts",
    )
    draw_suites(publication, folder, executor, progress=progress)
    parts = [LabNavEpisodes.load(folder / f"{SuiteName(part.task, part.level)}.json") for part in suite.parts]
    return LabNavSuite(f"{PREFIX}-{FRESH}", tuple(part.on(layouts) for part in parts))


def _floor_folder(out: Path, floors: int) -> Path:
    return out / f"floors-{floors}"
