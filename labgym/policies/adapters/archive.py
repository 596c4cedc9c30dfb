"""Zip archives of policies, checked on the sum of what they unpack to before a library reads them."""

from __future__ import annotations

import io
import zipfile
import zlib
from pathlib import Path

from labgym.errors import LabgymError

MAX_UNPACKED_BYTES = 512 * 2**20
"""Largest sum of all members when unpacked, also of the members of archives inside."""
MAX_MEMBERS = 10_000
MAX_NESTING = 2
"""An archive of stable-baselines3 holds archives of torch."""


def check_archive(path: Path) -> tuple[str, ...]:
    """Return the names of the members of a policy's zip archive.

    Raises:
        LabgymError: the file is not a zip archive, is damaged, or unpacks to too much.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            names = tuple(archive.namelist())
            _unpacked(path, archive, 1)
    except (zipfile.BadZipFile, zlib.error, ValueError, NotImplementedError, RuntimeError, OSError, EOFError) as error:
        raise LabgymError(f"policy {str(path)!r} is not a readable zip archive ({str(error)[:80]})") from None
    return names


def _unpacked(path: Path, archive: zipfile.ZipFile, depth: int) -> tuple[int, int]:
    """Return the number of members of an archive and their size when unpacked, bytes.

    Raises:
        LabgymError: they exceed the limits.
    """
    count, size = len(archive.infolist()), sum(member.file_size for member in archive.infolist())
    _check(path, count, size)
    for member in archive.infolist() if depth < MAX_NESTING else ():
        with archive.open(member) as stream:
            if stream.read(4) != b"PK\x03\x04":
                continue
        with zipfile.ZipFile(io.BytesIO(archive.read(member))) as inner:
            more = _unpacked(path, inner, depth + 1)
        count, size = count + more[0], size + more[1]
        _check(path, count, size)
    return count, size


def _check(path: Path, count: int, size: int) -> None:
    if count > MAX_MEMBERS or size > MAX_UNPACKED_BYTES:
        raise LabgymError(
            f"policy {str(path)!r} unpacks to {size} bytes in {count} files; at most {MAX_UNPACKED_BYTES} bytes in "
            f"{MAX_MEMBERS} files are loaded"
        )
