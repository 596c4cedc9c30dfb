"""Splits of floors that follow from a secret: the sealed one, and the fresh ones of a verifier.

The seeds of the floors are SHA-256 digests of a random secret of 256 bits and the number of the floor, so that nobody
can make the floors before the secret is public, and everybody can check afterwards that they were not exchanged. Of the
sealed split, hashes are published now and the secret at a later release. A verifier draws a secret for fresh floors.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.counts import MAX_SEED
from labgym.documents import Document, Record, read_bytes
from labgym.errors import DocumentError, OptionError
from labgym.layouts.places import ATTEMPTS, FIRST_SEALED_SEED

SEALED: Literal["floors-sealed"] = "floors-sealed"
"""Name of the sealed split."""
FRESH: Literal["floors-fresh"] = "floors-fresh"
"""Name of the split of fresh floors: those of any other secret."""
SECRET_SPLITS = (SEALED, FRESH)
"""Splits whose seeds follow from a secret, and whose floors no file of the package has."""
SEALED_FLOORS = 60
"""Number of its floors."""
COMMITMENT = "commitment.json"
SECRET_BYTES = 32
SECRET = "secret.txt"
"""File of the secret in the folder of its floors."""
_SECRET = re.compile(rb"[0-9a-f]{64}")

Hash = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class SealedFloor(Record):
    """A floor of the sealed split. Attributes: its id, and the hash of its layout."""

    id: str
    hash: Hash


class Commitment(Document):
    """The sealed split before its secret is public, `layouts/floors-sealed/commitment.json`.

    Attributes:
        secret: SHA-256 of the 32 bytes of the secret.
        furnisher: version of what makes the floors (`labgym.layouts.generate.FURNISHER`).
        labgym: version of labgym that made them.
        floors: the floors in their order.
        suite: canonical hash of the suite of their drives, as `labgym floors` writes it.
    """

    SCHEMA: ClassVar[str] = "labgym.commitment/1"

    split: Literal["floors-sealed"] = SEALED
    secret: Hash
    furnisher: Annotated[int, Field(ge=1)]
    labgym: str
    floors: Annotated[tuple[SealedFloor, ...], Field(max_length=10_000)]
    suite: Hash

    def differences(self, other: Commitment) -> tuple[str, ...]:
        """Return a sentence for each difference of another commitment, made with a secret, from this one."""
        problems = []
        if self.secret != other.secret:
            problems.append(f"the secret's SHA-256 is {other.secret[:12]}, committed {self.secret[:12]}")
        if self.furnisher != other.furnisher:
            problems.append(f"made by furnisher {other.furnisher}, committed {self.furnisher} (labgym {self.labgym})")
        if len(self.floors) != len(other.floors):
            problems.append(f"{len(other.floors)} floors, committed {len(self.floors)}")
        for own, floor in zip(self.floors, other.floors, strict=False):
            if own != floor:
                problems.append(f"{floor.id}: hash {floor.hash[:12]}, committed {own.hash[:12]} ({own.id})")
        if self.suite != other.suite:
            problems.append(f"the suite's hash is {other.suite[:12]}, committed {self.suite[:12]}")
        return tuple(problems)


def commitment() -> Commitment | None:
    """Return the published commitment, None if nothing is sealed.

    Raises:
        DocumentError: the file is broken.
    """
    path = artefacts("layouts") / SEALED / COMMITMENT
    return Commitment.load(path) if path.is_file() else None


def read_secret(path: str | Path) -> bytes:
    """Return the 32 bytes of a secret from a file of 64 hexadecimal digits.

    Raises:
        DocumentError: the file is missing or holds something else.
    """
    text = read_bytes(path, 1000).strip()
    if _SECRET.fullmatch(text) is None:
        raise DocumentError(path, "", f"expected {2 * SECRET_BYTES} hexadecimal digits (0-9, a-f)")
    return bytes.fromhex(text.decode())


def write_secret(path: str | Path, secret: bytes) -> Path:
    """Write a secret to a file that only its owner may read, and return the path.

    Raises:
        OptionError: the secret does not have 32 bytes, or the file exists.
    """
    secret_hash(secret)
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except FileExistsError:
        raise OptionError(f"{path} exists: a secret is not overwritten") from None
    with os.fdopen(handle, "w") as stream:
        stream.write(f"{secret.hex()}\n")
    return path


def secret_hash(secret: bytes) -> str:
    """Return the SHA-256 of a secret.

    Raises:
        OptionError: it does not have 32 bytes.
    """
    if len(secret) != SECRET_BYTES:
        raise OptionError(f"the secret has {len(secret)} bytes, expected {SECRET_BYTES}")
    return hashlib.sha256(secret).hexdigest()


def sealed_seeds(secret: bytes, index: int) -> Iterator[int]:
    """Yield the seeds of a floor, at least 10^10: the next is taken if a floor does not hold its protocols.

    A seed follows from the SHA-256 of the secret, the floor's number and the attempt's, in decimals.
    """
    for attempt in range(ATTEMPTS):
        digest = hashlib.sha256(secret + f":{index}:{attempt}".encode()).digest()
        yield FIRST_SEALED_SEED + int.from_bytes(digest, "big") % (MAX_SEED - FIRST_SEALED_SEED)
