"""Publishing a round of fresh floors: its secret, and the receipts of all policies that drove them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from labgym.artefacts import artefacts
from labgym.documents import write_text
from labgym.errors import DocumentError, OptionError
from labgym.eval.labnav.gain import gain
from labgym.eval.leaderboard.labnav import LabNavResult, published_results
from labgym.eval.leaderboard.receipts import FOLDER, FreshReceipt, published_rounds, round_of_secret
from labgym.layouts.sealed import SECRET, read_secret, secret_hash

RECEIPTS = "receipts"
"""Folder of the receipts in that of a round's drives."""
_NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")


def publish_round(folder: str | Path, place: Path | None = None) -> tuple[Path, ...]:
    """Write the secret and the receipts of a round among the published ones, and return the paths.

    Afterwards the floors are public: the next check needs another secret.

    Args:
        folder: of `labgym submit check --fresh --out`; the round has its name. place: another folder to write to.

    Raises:
        DocumentError: the secret or a receipt is missing or broken, or a receipt contradicts the published result.
        OptionError: the name is not one for a round, or the round or its secret is published.
    """
    folder = Path(folder).resolve()
    if _NAME.fullmatch(folder.name) is None:
        raise OptionError(f"round {folder.name[:60]!r}: name its folder with a-z, 0-9 and hyphens, such as 2026-11")
    place = artefacts("eval") / FOLDER if place is None else place
    target, secret = place / folder.name, read_secret(folder / SECRET)
    if target.exists():
        raise OptionError(f"round {folder.name} is published: rename the folder of the new one")
    if public := round_of_secret(secret_hash(secret), published_rounds(place)):
        raise OptionError(f"the secret of {folder.name} is that of round {public}, which is public")
    receipts = [(path, FreshReceipt.load(path)) for path in sorted((folder / RECEIPTS).glob("*.json"))]
    if not receipts:
        raise DocumentError(folder, "", f"holds no receipts: labgym submit check --fresh 60 --out {folder.name}")
    results = {result.summary.policy: result for result in published_results()}
    for path, receipt in receipts:
        for problem in _problems(receipt, secret_hash(secret), results):
            raise DocumentError(path, "", problem)
    written = [receipt.save(target / path.name) for path, receipt in receipts]
    return (*written, write_text(target / SECRET, f"{secret.hex()}\n"))


def _problems(receipt: FreshReceipt, digest: str, results: Mapping[str, LabNavResult]) -> Iterator[str]:
    """Yield a sentence if a receipt is of another secret or contradicts the published result of its policy."""
    result = results.get(receipt.policy)
    if receipt.secret != digest:
        yield f"its floors follow from another secret ({receipt.secret[:12]}) than that of the round ({digest[:12]})"
    elif result is None or not receipt.is_of(result.summary):
        yield f"is not of the published result of {receipt.policy}: add that with labgym leaderboard --add first"
    elif not receipt.gain.is_near(gain({key: one.score for key, one in result.by_key.items()}, receipt.scores)):
        yield "its figures do not follow from its scores and the published ones: check the result again"
