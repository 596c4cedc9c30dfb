"""USDZ packages: check of the contents before they are read."""

from __future__ import annotations

import zipfile
from pathlib import Path, PurePosixPath

from labgym.assets.meshes.model import Limits, MeshError, printable

MAX_ENTRIES = 1024


def check_package(path: Path, limits: Limits) -> None:
    """Check a usdz file's directory: only stored entries, as the format requires, within the size limit.

    Raises:
        MeshError: not a zip file, or an entry that is compressed, encrypted, overlapping, a package itself, or named
            outside the package.
    """
    try:
        with zipfile.ZipFile(path) as package:
            entries = package.infolist()
    except (zipfile.BadZipFile, ValueError, NotImplementedError, UnicodeDecodeError, OSError) as error:
        raise MeshError(path, f"not a usdz package ({printable(error, 120)}); export it again") from None
    if not 0 < len(entries) <= MAX_ENTRIES:
        raise MeshError(path, f"holds {len(entries)} files, expected 1 to {MAX_ENTRIES}; package the model alone")
    for entry in entries:
        name = printable(entry.filename, 120)
        inside = PurePosixPath(entry.filename.replace("\\", "/"))
        if inside.is_absolute() or ".." in inside.parts or ":" in entry.filename:
            raise MeshError(path, f"names the file {name!r}, outside the package; package the model again")
        if entry.compress_type != zipfile.ZIP_STORED or entry.compress_size != entry.file_size:
            grown = f"{entry.compress_size} bytes that unpack to {entry.file_size}"
            raise MeshError(path, f"its {name!r} is compressed ({grown}); usdz stores files as they are: repack it")
        if entry.flag_bits & 0x1:
            raise MeshError(path, f"its {name!r} is encrypted; package the model without a password")
        if inside.suffix.lower() in (".usdz", ".zip"):
            raise MeshError(path, f"holds the package {name!r}, which is not opened; package the model flat")
    total = sum(entry.file_size for entry in entries)
    if total > min(limits.bytes, path.stat().st_size):
        most = min(limits.bytes, path.stat().st_size)
        raise MeshError(path, f"its files claim {total} bytes, expected at most {most}; it may be a zip bomb")
