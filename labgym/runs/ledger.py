"""`ledger.jsonl`: a line for each finished shard, appended after its files are in place."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labgym.documents import write_bytes

LEDGER_FILE = "ledger.jsonl"
FLUSH_SECONDS = 1.0
"""Longest time between a line and the flush to the disk: a power failure costs at most the shards of this time."""


@dataclass(frozen=True)
class LedgerEntry:
    """A finished shard.

    Attributes:
        shard: its name.
        inputs: digest of the shard's inputs.
        files: SHA-256 of each file by path relative to the run's folder.
        record: small JSON data of the shard's output.
    """

    shard: str
    inputs: str
    files: dict[str, str]
    record: Any = None


class Ledger:
    """The finished shards of a run by name. Reading is linear; a line costs a write, and a flush at most each second.

    Lines that are torn or broken are dropped: their shards run again.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / LEDGER_FILE
        self._lines = dict(_read(self._path))
        self._handle: int | None = None
        self._flushed = time.monotonic()

    def __len__(self) -> int:
        return len(self._lines)

    def __iter__(self) -> Iterator[LedgerEntry]:
        return (entry for line in self._lines.values() if (entry := _parse(line)) is not None)

    def get(self, shard: str) -> LedgerEntry | None:
        """Return the entry of a shard, or None if it has not finished."""
        line = self._lines.get(shard)
        return None if line is None else _parse(line)

    def append(self, entry: LedgerEntry) -> None:
        """Append a line for a finished shard."""
        line = json.dumps(vars(entry), ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()
        if self._handle is None:
            self._handle = os.open(self._path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
            size = os.fstat(self._handle).st_size
            if size and os.pread(self._handle, 1, size - 1) != b"\n":
                os.write(self._handle, b"\n")  # The last line is torn.
        os.write(self._handle, line + b"\n")
        self._lines[entry.shard] = line
        if time.monotonic() - self._flushed > FLUSH_SECONDS:
            self._flush()

    def keep(self, wanted: Callable[[LedgerEntry], bool]) -> None:
        """Rewrite the ledger in the order of names with the wanted entries; remove it if no entry is wanted."""
        self.close()
        self._lines = {entry.shard: self._lines[entry.shard] for entry in self if wanted(entry)}
        self._lines = dict(sorted(self._lines.items()))
        if self._lines:
            write_bytes(self._path, b"".join(line + b"\n" for line in self._lines.values()))
        else:
            self._path.unlink(missing_ok=True)

    def close(self) -> None:
        """Flush and close the file."""
        if self._handle is not None:
            self._flush()
            os.close(self._handle)
            self._handle = None

    def _flush(self) -> None:
        if self._handle is not None:
            os.fsync(self._handle)
        self._flushed = time.monotonic()


def _read(path: Path) -> Iterator[tuple[str, bytes]]:
    if not path.exists():
        return
    with path.open("rb") as stream:
        for line in stream:
            entry = _parse(line.rstrip(b"\n"))
            if entry is not None:
                yield entry.shard, line.rstrip(b"\n")


def _parse(line: bytes) -> LedgerEntry | None:
    try:
        entry = LedgerEntry(**json.loads(line))
    except (ValueError, TypeError, RecursionError):
        return None
    whole = isinstance(entry.shard, str) and isinstance(entry.inputs, str) and isinstance(entry.files, dict)
    return entry if whole and all(isinstance(item, str) for item in entry.files.values()) else None
