"""Receipts of drives on fresh floors, and the published rounds: receipts that share a secret."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from labgym.artefacts import artefacts
from labgym.documents import Document
from labgym.eval.driving.episode_row import Share
from labgym.eval.driving.intervals import Estimate
from labgym.eval.labnav.gain import Gain
from labgym.eval.labnav.summary import LabNavSummary
from labgym.layouts.sealed import SECRET, Hash, SealedFloor, read_secret, secret_hash
from labgym.policies.fingerprint.policy import PolicyFingerprint

FOLDER = "leaderboard/fresh"
"""Folder of the published rounds."""
ALARM: Literal["alarm"] = "alarm"
PASSED: Literal["no alarm"] = "no alarm"
SAME = ("policy", "options", "track", "sensors", "seed", "latency", "declared", "box")
"""Fields in which all results of one policy agree, on published and on fresh floors."""


class FreshReceipt(Document):
    """The scores of a policy on fresh floors, compared with those on published ones.

    Everybody who has the secret of the round can draw its floors again and recompute all figures.

    Attributes:
        secret: SHA-256 of the secret from which the floors follow. floors: those that were drawn, with their hashes.
        per_floor: episodes of each task on a floor.
        fingerprint: of the policy. labgym, code: version and digest of the code that drove.
        suite: name of the published suite. episodes: its hash. figure: LabNav there; None unless it has all tasks.
        summary: of the drives on fresh floors: figure with interval, name and hash of their suite, scores of the tasks.
        scores: on fresh floors by the episodes' keys.
        gain: difference of the mean scores, published - fresh. verdict: whether it is an alarm.
    """

    SCHEMA: ClassVar[str] = "labgym.fresh-receipt/1"

    secret: Hash
    floors: Annotated[tuple[SealedFloor, ...], Field(min_length=1, max_length=10_000)]
    per_floor: Annotated[int, Field(ge=1, le=100)]
    fingerprint: PolicyFingerprint
    labgym: Annotated[str, Field(max_length=100)]
    code: Annotated[str, Field(max_length=100)]
    suite: Annotated[str, Field(max_length=200)]
    episodes: Hash
    figure: Estimate | None
    summary: LabNavSummary
    scores: Annotated[dict[str, Share], Field(min_length=1, max_length=100_000)]
    gain: Gain
    verdict: Literal["alarm", "no alarm"]

    @model_validator(mode="after")
    def _check_verdict(self) -> Self:
        expected = ALARM if self.gain.alarm else PASSED
        if self.verdict != expected:
            raise ValueError(f"verdict is {self.verdict!r}, but z {self.gain.z:g} and the difference say {expected!r}")
        return self

    @property
    def policy(self) -> str:
        """Label of the policy."""
        return self.summary.policy

    def is_of(self, summary: LabNavSummary) -> bool:
        """Whether the receipt is of the policy and the published figure of a result."""
        same = all(getattr(self.summary, name) == getattr(summary, name) for name in SAME)
        figures = [
            None if one is None or one.value is None else round(one.value, 6) for one in (self.figure, summary.labnav)
        ]
        return same and self.episodes == summary.hash and figures[0] == figures[1]

    @property
    def sentence(self) -> str:
        """The outcome in a sentence."""
        gain, floors = self.gain, len(self.floors)
        text = (
            f"mean score {gain.published:.3f} on published floors, {gain.fresh:.3f} on {floors} fresh floors: "
            f"difference {gain.difference:+.3f}, standard error {gain.error:.3f}, z {gain.z:.1f}"
        )
        return f"{text}: {'ALARM, the policy gains on floors that it may have seen' if gain.alarm else PASSED}"


@dataclass(frozen=True)
class FreshRound:
    """A published round.

    Attributes:
        name: of the round. secret: 32 bytes. receipts: by the label of the policy.
    """

    name: str
    secret: bytes
    receipts: dict[str, FreshReceipt]

    @classmethod
    def read(cls, folder: Path) -> FreshRound:
        """Return the round in a folder.

        Raises:
            DocumentError: a file is missing or broken.
        """
        receipts = [FreshReceipt.load(path) for path in sorted(folder.glob("*.json"))]
        return cls(folder.name, read_secret(folder / SECRET), {receipt.policy: receipt for receipt in receipts})


def published_rounds(place: Path | None = None) -> tuple[FreshRound, ...]:
    """Return the published rounds in the order of their names.

    Args:
        place: another folder than eval/leaderboard/fresh.

    Raises:
        DocumentError: a file is missing or broken.
    """
    place = artefacts("eval") / FOLDER if place is None else place
    return tuple(FreshRound.read(folder) for folder in sorted(place.glob("*/")) if (folder / SECRET).is_file())


def round_of_secret(digest: str, rounds: Iterable[FreshRound]) -> str | None:
    """Return the name of the round whose secret has a SHA-256, None if it is not public."""
    return next((one.name for one in rounds if secret_hash(one.secret) == digest), None)


def receipt_of(summary: LabNavSummary, rounds: Sequence[FreshRound]) -> FreshReceipt | None:
    """Return the receipt that decides on a published result: an alarm of any round, else that of the last one."""
    receipts = [one.receipts[summary.policy] for one in rounds if summary.policy in one.receipts]
    fitting = [receipt for receipt in receipts if receipt.is_of(summary)]
    alarms = [receipt for receipt in fitting if receipt.verdict == ALARM]
    return next(reversed(alarms or fitting), None)


def has_alarm(summary: LabNavSummary, rounds: Sequence[FreshRound]) -> bool:
    """Whether an alarm of a round takes a published result out of the ranking."""
    receipt = receipt_of(summary, rounds)
    return receipt is not None and receipt.verdict == ALARM
