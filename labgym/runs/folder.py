"""The folder of a run: a lock for its only writer, one identity, finished shards, merged output, a manifest."""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
import socket
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path, PurePosixPath
from typing import Any

from labgym.documents import Document, append_text, canonical_hash, folder_path, write_bytes
from labgym.errors import LabgymError, OptionError
from labgym.runs.identity import IDENTITY_FILE, REMEDY, RunIdentity, read_identity, refusal
from labgym.runs.ledger import LEDGER_FILE, Ledger, LedgerEntry
from labgym.runs.manifest import MANIFEST_FILE, RunManifest, file_digest
from labgym.runs.provenance import PROVENANCE_FILE, provenance
from labgym.temporary import PREFIX, sweep

LOCK_FILE = ".lock"

SHARDS = "shards"
"""Folder of the shard files that are merged: `finish` removes it."""

RESERVED = (IDENTITY_FILE, LEDGER_FILE, MANIFEST_FILE, LOCK_FILE, PROVENANCE_FILE)

Content = bytes | Iterable[bytes]

Files = Mapping[str, Content] | Iterable[tuple[str, Content]]

REMOVING_THREADS = 8

FILES_PER_CALL = 200
"""Files that a thread removes before it takes the next ones."""


@contextmanager
def only_writer(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, which is created if it does not exist.

    The lock is a `flock` on the empty file `.lock`; the kernel releases it when the process dies.

    Raises:
        OptionError: another process holds the lock, or the path is not a folder.
    """
    handle = _lock(folder)
    try:
        os.ftruncate(handle, 0)
        os.write(handle, f"process {os.getpid()} on {socket.gethostname()}".encode())
        yield
    finally:
        os.ftruncate(handle, 0)
        os.close(handle)


def _lock(folder: Path) -> int:
    path = folder / LOCK_FILE
    while True:
        if folder.exists() and not folder.is_dir():
            raise OptionError(f"{folder} is not a folder; name another one")
        folder.mkdir(parents=True, exist_ok=True)
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except FileNotFoundError:
            continue  # Moved aside since the line above.
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if path.exists() and os.path.samestat(os.fstat(handle), path.stat()):
                return handle
            os.close(handle)
        except BlockingIOError:
            writer = os.pread(handle, 200, 0).decode(errors="replace") or "another process"
            os.close(handle)
            raise OptionError(
                f"{folder} is in use: {writer} writes into it; wait for it, or choose another folder"
            ) from None


def remove_folder(folder: Path) -> None:
    """Remove a folder with its files, by several threads; what cannot be removed stays, and so does a link.

    Removing a file waits for the disk if its blocks are discarded at once (mount option `discard`), or for the server
    of a network file system: milliseconds each, which threads spend at the same time.
    """
    if folder.is_symlink():
        return
    with ThreadPoolExecutor(REMOVING_THREADS) as pool:
        for parent, _, names in os.walk(folder):
            paths = [os.path.join(parent, name) for name in names]  # noqa: PTH118 -- Path takes as long as the removal
            batches = [paths[start : start + FILES_PER_CALL] for start in range(0, len(paths), FILES_PER_CALL)]
            for _ in pool.map(_remove, batches):
                pass
    shutil.rmtree(folder, ignore_errors=True)


def _remove(paths: Sequence[str]) -> None:
    for path in paths:
        with suppress(OSError):
            os.unlink(path)  # noqa: PTH108


class RunFolder:
    """The folder of a run, open for writing. Use `RunFolder.open`.

    Shards that are merged write their files below `shards/`; other files of shards stay where they are.

    Attributes:
        path: the folder.
        identity: the run that it holds.
    """

    def __init__(self, path: Path, identity: RunIdentity) -> None:
        self.path, self.identity = path, identity
        self._ledger = Ledger(path)

    @classmethod
    @contextmanager
    def open(
        cls,
        path: str | Path,
        identity: RunIdentity,
        fresh: bool = False,
        kernels: Mapping[str, str | int] | None = None,
    ) -> Iterator[RunFolder]:
        """Open the folder of a run, new or to resume it, as its only writer.

        Temporary files that killed processes left in it are removed.

        Args:
            path: the folder; it is created if it does not exist.
            identity: the run.
            fresh: rename an existing folder to NAME.old-1, NAME.old-2, ... and start anew.
            kernels: numerical kernels of the policy's process, for the provenance of the session.

        Raises:
            OptionError: another process writes into the folder, or it holds another run or other files,
                or its name is a file's.
        """
        path = folder_path(path)
        if fresh:
            move_aside(path)
        if path.is_dir():
            _check_identity(path, identity)  # Before the lock: a folder that is refused is not touched.
        with only_writer(path):
            if not _check_identity(path, identity):
                identity.save(path / IDENTITY_FILE)
            sweep(path, recursive=True)
            append_text(path / PROVENANCE_FILE, provenance(kernels).line())
            folder = cls(path, identity)
            try:
                folder._tidy()
                yield folder
            finally:
                folder._ledger.close()

    @property
    def finished(self) -> bool:
        """Whether the run has finished and its merged files have the hashes of the manifest.

        Raises:
            DocumentError: a merged file is missing or was changed.
        """
        manifest = self._manifest()
        if manifest is None:
            return False
        of_shards = {name for entry in self._ledger for name in entry.files}
        manifest.check(self.path, *(name for name in manifest.files if name not in of_shards))
        return True

    def output(self, shard: str, inputs: Any = None) -> tuple[dict[str, bytes], Any] | None:
        """Return the files and the record of a finished shard, or None if it must run (again).

        A shard must run if its inputs changed, or a file is missing or has another hash.
        """
        entry = self._ledger.get(shard)
        if entry is None or entry.inputs != canonical_hash(inputs):
            return None
        files = {}
        for name, digest in entry.files.items():
            try:
                files[name] = (self.path / _checked(name)).read_bytes()
            except (OSError, ValueError, LabgymError):  # missing, or a damaged ledger names something else
                return None
            if hashlib.sha256(files[name]).hexdigest() != digest:
                return None
        return files, entry.record

    def put(self, shard: str, inputs: Any, files: Mapping[str, bytes], record: Any = None) -> None:
        """Write the files of a finished shard, then its line in the ledger.

        Raises:
            LabgymError: a path leaves the folder or is reserved.
        """
        for name, content in files.items():
            write_bytes(self.path / _checked(name), content)
        digests = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
        self._ledger.append(LedgerEntry(shard, canonical_hash(inputs), digests, record))

    def finish(
        self,
        files: Files,
        manifest: Document | None = None,
        unlisted: Sequence[str] = (),
        measured: Mapping[str, Content] | None = None,
    ) -> None:
        """Write the merged files, then the manifest of all files; then remove the merged shard files.

        Args:
            files: content by path relative to the folder, or pairs of both; content is in one piece or in several.
            manifest: a document of another kind that takes the place of the manifest. `finished` is then never
                true: opening the run again checks the shards by the ledger.
            unlisted: subfolders of shard files that other commands may write again, such as pictures of results; the
                manifest does not list their files.
            measured: further files, which differ between equal runs, such as times; the manifest does not list them.
        """
        for name, content in (measured or {}).items():
            write_bytes(self.path / _checked(name), content)
        digests = {}
        for name, content in files.items() if isinstance(files, Mapping) else files:
            write_bytes(self.path / _checked(name), content)
            digests[name] = file_digest(self.path / name) or ""
        merged = tuple(digests)
        for entry in self._ledger:
            digests |= {
                name: digest
                for name, digest in entry.files.items()
                if name.partition("/")[0] not in (SHARDS, *unlisted)
            }
        manifest = manifest or RunManifest(run=self.identity.digest, files=dict(sorted(digests.items())))
        manifest.save(self.path / MANIFEST_FILE)
        for name in (*merged, MANIFEST_FILE, "."):
            _flush(self.path / name)  # Before the shards go: a power failure must not lose both.
        self._remove_merged()

    def _manifest(self) -> RunManifest | None:
        manifest = RunManifest.read(self.path)
        return manifest if manifest is not None and manifest.run == self.identity.digest else None

    def _tidy(self) -> None:
        """Remove merged shard files and their lines in the ledger once the manifest is written."""
        if self._manifest() is not None:
            self._remove_merged()

    def _remove_merged(self) -> None:
        self._ledger.keep(lambda entry: not any(map(_is_merged, entry.files)))
        remove_folder(self.path / SHARDS)


def _flush(path: Path) -> None:
    """Write a file or a folder's entries to the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def move_aside(path: Path) -> Path | None:
    """Rename a folder to the first free NAME.old-N and return the new path; None if there is nothing to move.

    Raises:
        OptionError: another process writes into the folder, or it contains the working folder.
    """
    if not path.exists() or (path.is_dir() and not any(path.iterdir())):
        return None
    if Path.cwd().is_relative_to(path.resolve()):
        raise OptionError(f"{path} contains the working folder, which --fresh cannot move; choose another folder")
    with only_writer(path):
        number = 1
        while (target := path.with_name(f"{path.resolve().name}.old-{number}")).exists():
            number += 1
        os.rename(path, target)  # noqa: PTH104 -- Path.rename would do the same; os.rename refuses a folder that exists
    return target


def _check_identity(path: Path, identity: RunIdentity) -> bool:
    """Return whether the folder already holds this run; False if it is empty.

    Raises:
        OptionError: it holds another run or other files.
    """
    present = read_identity(path)
    if present is not None:
        if present.differences(identity):
            raise OptionError(refusal(path, present, identity))
        return True
    others = sorted(entry.name for entry in path.iterdir() if not entry.name.startswith((LOCK_FILE, PREFIX)))
    if others:
        raise OptionError(f"{path} holds {', '.join(others[:3])}, which is not a run; {REMEDY}")
    return False


def _is_merged(name: str) -> bool:
    return name.startswith(f"{SHARDS}/")


def _checked(name: str) -> str:
    parts = PurePosixPath(name).parts
    if not parts or name in RESERVED or PurePosixPath(name).is_absolute() or ".." in parts:
        raise LabgymError(f"file {name!r} of a shard leaves the run's folder or has a reserved name ({RESERVED})")
    return name
