"""`run.json`: the inputs and the code that determine the bytes of a run, and the differences between two runs."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

from pydantic import field_validator

import labgym
from labgym.artefacts import artefacts
from labgym.documents import Document, canonical_hash, parse_json, read_json, validating

SOURCES = (".py", ".j2")

IDENTITY_FILE = "run.json"

REMEDY = "choose another folder, or move the old one aside and start anew with --fresh"

MAX_PRINTED = 40
"""Longest value that a refusal prints, characters of JSON."""


@cache
def code_digest() -> str:
    """Return the SHA-256 of the package's sources and templates and of the JSON files of the assets.

    Paths are hashed relative to the package and to the artefact folder, so that a checkout and a wheel of the same
    version have the same digest. Published layouts, suites and weights are not included: a run names those that it
    uses by their own hashes.
    """
    package = Path(labgym.__file__).resolve().parent
    assets = artefacts("assets")
    sources = [path for path in package.rglob("*") if path.suffix in SOURCES]
    files = {path.relative_to(package).as_posix(): path for path in sources if "_artefacts" not in path.parts}
    files |= {f"assets/{path.relative_to(assets).as_posix()}": path for path in assets.rglob("*.json")}
    digest = hashlib.sha256()
    for name in sorted(files):
        digest.update(f"{name}\0{hashlib.sha256(files[name].read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()


class RunIdentity(Document):
    """Identity of the run stored in a folder, written before its first shard.

    Attributes:
        kind: the command: eval, data, generate, score, run, train, add or import.
        inputs: JSON data that decides the bytes of the run, by the name that a refusal prints: suite, layouts,
            policy, seed, catalog and so on. Large inputs are named by their hashes.
        code: `code_digest()` of the code that runs.
    """

    SCHEMA: ClassVar[str] = "labgym.run/2"

    kind: str
    inputs: dict[str, Any]
    code: str

    @field_validator("inputs", mode="before")
    @classmethod
    def _as_json(cls, inputs: Any) -> Any:
        """Return the inputs as they are read back from the file: tuples become lists."""
        try:
            return parse_json(json.dumps(inputs, allow_nan=False).encode(), "inputs")
        except (TypeError, RecursionError) as error:
            raise ValueError(f"not JSON data ({error})") from None

    @classmethod
    def of(cls, kind: str, **inputs: Any) -> RunIdentity:
        """Return the identity of a run of this kind by the present code.

        Raises:
            DocumentError: an input is not JSON data, or a number in it exceeds the bounds of documents.
        """
        with validating(IDENTITY_FILE):
            return cls(kind=kind, inputs=inputs, code=code_digest())

    @property
    def digest(self) -> str:
        """SHA-256 of the identity."""
        return canonical_hash(self.to_json())

    def differences(self, other: RunIdentity) -> tuple[str, ...]:
        """Return the names of the differences between two runs: "kind", "code", or names of inputs."""
        names = [name for name in ("kind", "code") if getattr(self, name) != getattr(other, name)]
        keys = [*self.inputs, *(key for key in other.inputs if key not in self.inputs)]
        return (*names, *(key for key in keys if _input(self, key) != _input(other, key)))


def read_identity(folder: Path) -> RunIdentity | None:
    """Return the identity of the run stored in a folder, or None if the folder holds no run.

    Raises:
        DocumentError: `run.json` is broken.
    """
    path = folder / IDENTITY_FILE
    data = read_json(path) if path.exists() else None
    return None if data is None else RunIdentity.parse(data, path)


def refusal(folder: Path, present: RunIdentity, requested: RunIdentity) -> str:
    """Return the message that refuses the folder of another run: the differences, with short values, and the remedy."""
    names = present.differences(requested)
    differences = ", ".join(_difference(name, present, requested) for name in names)
    return f"{folder} holds another run, which differs in {differences}; {REMEDY}"


def _difference(name: str, present: RunIdentity, requested: RunIdentity) -> str:
    if name == "code":
        return "code (another version of labgym or of its assets)"
    pair = [json.dumps(getattr(run, name, None) or _input(run, name)) for run in (present, requested)]
    return name if max(map(len, pair)) > MAX_PRINTED else f"{name} ({pair[0]} there, {pair[1]} requested)"


def _input(identity: RunIdentity, name: str) -> Any:
    return identity.inputs.get(name, "absent")
