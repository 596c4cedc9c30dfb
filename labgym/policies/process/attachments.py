"""Files that travel with a policy to workers on other machines: its module, its weights, files that options name."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from labgym.documents import canonical_hash, write_bytes
from labgym.errors import OptionError
from labgym.policies.fingerprint.sources import is_installed_file, module_file, source_files
from labgym.runs import Blob

MAX_BYTES = 512 * 2**20
"""Largest size of all attachments of a policy."""


@dataclass(frozen=True)
class Attachment:
    """A file that travels with a policy.

    Attributes:
        path: its path relative to the folder of the attachments.
        content: its bytes.
        names: the name or option of the policy that stands for it, and the path that replaces it there; None for the
            source files of a module, which are imported.
    """

    path: str
    content: Blob
    names: tuple[str, str] | None = None


def module_attachments(modules: Iterable[str]) -> tuple[Attachment, ...]:
    """Return the source files of modules that are not installed, with the modules of their folders that they import."""
    sources: dict[str, Path] = {}
    for module in modules:
        file = module_file(module)
        if file is not None and not is_installed_file(file):
            sources |= source_files(file, module)
    return _checked([Attachment(path, Blob(file.read_bytes())) for path, file in sorted(sources.items())])


def file_attachments(texts: Iterable[str], files: Sequence[Path]) -> tuple[Attachment, ...]:
    """Return those of a policy's files that a text names: the file itself, or a folder that holds it.

    Args:
        texts: the policy's name and its options.
        files: absolute paths of the files that the policy reads.
    """
    attachments = []
    for number, text in enumerate(texts):
        named = Path(text).absolute()
        for file in files:
            if file == named or file.is_relative_to(named):
                root = f"{number}/{named.name}"
                path = root if file == named else f"{root}/{file.relative_to(named).as_posix()}"
                attachments.append(Attachment(path, Blob(file.read_bytes()), (text, root)))
    return _checked(attachments)


def write_attachments(attachments: Sequence[Attachment]) -> Path:
    """Write attachments to the user's cache, where nothing else changes them, and return their folder."""
    digest = canonical_hash([[each.path, each.content.digest] for each in attachments])
    folder = _cache() / digest
    for each in attachments:
        path = folder / each.path
        if not path.is_file() or path.read_bytes() != each.content.content:
            write_bytes(path, each.content.content)
    return folder


def _cache() -> Path:
    home = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")  # noqa: PTH111 -- without a home it stays
    folder = Path(home) / "labgym" / "attachments"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.mkdtemp(prefix="labgym-attachments-"))
    return folder


def _checked(attachments: list[Attachment]) -> tuple[Attachment, ...]:
    size = sum(len(each.content.content) for each in attachments)
    if size > MAX_BYTES:
        raise OptionError(f"the files of the policy have {size} bytes; at most {MAX_BYTES} are sent to other machines")
    return tuple(attachments)
