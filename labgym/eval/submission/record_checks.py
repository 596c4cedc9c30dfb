"""Checks of the declarations of a submission: identity, manifest, provenance and summary."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from labgym.documents import parse_json, read_json, validating
from labgym.errors import DocumentError
from labgym.eval.driving.files import ACTIONS, EPISODES, ROUTES, SUMMARY
from labgym.policies.kernels import PINNED
from labgym.policies.process.box import BUILT_IN_CODE
from labgym.policies.registry import BUILT_IN
from labgym.runs import RunProvenance, code_digest
from labgym.runs.identity import IDENTITY_FILE, RunIdentity
from labgym.runs.manifest import MANIFEST_FILE, RunManifest, file_digest
from labgym.runs.provenance import PROVENANCE_FILE

MAX_SESSIONS = 1000
"""Number of lines of the provenance that are read."""
MAX_FILE = 4 * 2**30
"""Largest file whose hash is computed, bytes."""
MAX_SESSION = 64 * 1024
"""Longest line of the provenance, bytes."""


@dataclass(frozen=True)
class RunRecord:
    """The record of the run in a folder; a part that cannot be read is None or empty, with a problem.

    Attributes:
        identity: `run.json`. manifest: `manifest.json`. sessions: `provenance.jsonl`.
    """

    folder: Path
    identity: RunIdentity | None
    manifest: RunManifest | None
    sessions: tuple[RunProvenance, ...]
    problems: tuple[str, ...]

    @classmethod
    def read(cls, folder: Path) -> RunRecord:
        """Read the record in a folder."""
        problems: list[str] = []
        identity = manifest = None
        try:
            identity = RunIdentity.load(folder / IDENTITY_FILE)
        except DocumentError as error:
            problems.append(str(error))
        try:
            manifest = RunManifest.parse(read_json(folder / MANIFEST_FILE), folder / MANIFEST_FILE)
        except DocumentError as error:
            problems.append(str(error))
        try:
            sessions = tuple(_sessions(folder / PROVENANCE_FILE))
        except DocumentError as error:
            sessions = ()
            problems.append(str(error))
        return cls(folder, identity, manifest, sessions, tuple(problems))

    @property
    def code_is_present(self) -> bool:
        """Whether the run was made by the code of this installation."""
        return self.identity is not None and self.identity.code == code_digest()


def run_problems(record: RunRecord, identity: Iterable[str], other_code: bool) -> Iterator[str]:
    """Yield a sentence for each part of a run's record that is missing or does not agree with the files.

    Args:
        record: the record of the run. identity: problems of its identity. other_code: accept another version of labgym.
    """
    yield from record.problems
    if record.identity is not None:
        yield from identity
        if not record.code_is_present and not other_code:
            yield (
                f"{IDENTITY_FILE}: driven by other code ({record.identity.code[:12]}) than this installation's "
                f"({code_digest()[:12]}): check it with that version of labgym, or accept it with --other-code"
            )
        if record.manifest is not None:
            if record.manifest.run != record.identity.digest:
                yield f"{MANIFEST_FILE} belongs to another run than {IDENTITY_FILE}"
            yield from _manifest_problems(record.folder, record.manifest)
    if not record.problems and not any("labgym" in session.versions for session in record.sessions):
        yield f"{PROVENANCE_FILE} does not record the version of labgym"


def stated_problems(identity: RunIdentity, kind: str, expected: Mapping[str, object]) -> Iterator[str]:
    """Yield a sentence for each input of an identity that differs from the summary's, and for unpinned kernels.

    Args:
        identity: `run.json`. kind: expected of the run. expected: inputs of the run by name; of "policy" its label.
    """
    if identity.kind != kind:
        yield f"{IDENTITY_FILE} is that of a {identity.kind[:40]!r} run, expected {kind!r}"
        return
    policy = identity.inputs.get("policy")
    stated = {**identity.inputs, "policy": policy.get("label") if isinstance(policy, dict) else None}
    for name, value in expected.items():
        if stated.get(name) != value:
            yield f"{IDENTITY_FILE} and {SUMMARY} differ in {name}"
    if identity.inputs.get("kernels") != PINNED.name:
        yield f"{IDENTITY_FILE}: not driven in kernels {PINNED.name}; the results of others depend on the machine"


def box_problems(identity: RunIdentity, level: str) -> Iterator[str]:
    """Yield a sentence if a run and its summary state other boxes, or a foreign policy poses as labgym's own.

    Args:
        identity: `run.json`. level: of the box, by the summary.
    """
    if identity.inputs.get("box", BUILT_IN_CODE) != level:
        yield f"{IDENTITY_FILE} and {SUMMARY} differ in box"
    policy = identity.inputs.get("policy")
    place = policy.get("place") if isinstance(policy, dict) else None
    if level == BUILT_IN_CODE and place not in [entry.place for entry in BUILT_IN.values()]:
        yield f"{SUMMARY} says {level!r}, but {str(place)[:80]!r} in {IDENTITY_FILE} is none: it must say its box"


def catalog_problems(identity: RunIdentity, catalog: str) -> Iterator[str]:
    """Yield a sentence if a run was driven with another catalog than that of a digest."""
    if identity.inputs.get("catalog") != catalog:
        yield f"{IDENTITY_FILE}: driven with another catalog of assets than this installation's"


def _manifest_problems(folder: Path, manifest: RunManifest) -> Iterator[str]:
    for name in (EPISODES, ROUTES, ACTIONS, SUMMARY):
        if name not in manifest.files:
            yield f"{MANIFEST_FILE} does not list {name}"
        elif (folder / name).is_file() and (folder / name).stat().st_size > MAX_FILE:
            yield f"{name} is larger than {MAX_FILE} bytes"
        elif file_digest(folder / name) != manifest.files[name]:
            yield f"{name} was changed after the run: its hash is not the one in {MANIFEST_FILE}"


def _sessions(path: Path) -> Iterator[RunProvenance]:
    if not path.is_file():
        raise DocumentError(path, "", "is missing: it records versions and machine")
    with path.open("rb") as stream:
        for _ in range(MAX_SESSIONS):
            line = stream.readline(MAX_SESSION)
            if not line:
                return
            with validating(path):
                session = RunProvenance.model_validate(parse_json(line, path))
            yield session
