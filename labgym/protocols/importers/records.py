"""Files of an import and their records; each format has a module with `files`, `read` and maybe `companions`.

Each record becomes an experiment or a rejection, and no file stops the others.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Literal, get_args

from pydantic import ValidationError

from labgym.documents import document_error
from labgym.errors import DocumentError, OptionError
from labgym.protocols.experiments import Experiment, Rejection

Records = Iterator[Experiment | Rejection]
Format = Literal["chemtrans", "openexp", "ord", "xdl"]


class UnreadableError(Exception):
    """A record cannot be expressed as the actions of an experiment; the message says why."""


def from_file(file: Path, folder: Path, read: Callable[[Path, Path], Records]) -> Records:
    """Return the records of a file of a folder; if it cannot be read, the last one is a rejection that says why."""
    try:
        yield from read(file, folder)
    except DocumentError as error:
        yield Rejection(str(file.relative_to(folder)), str(error))


def record(place: str, build: Callable[[], Experiment]) -> Experiment | Rejection:
    """Return the experiment that a function builds, or a rejection if the record is unreadable or invalid.

    Args:
        place: where the record is, as file:line or file:index.
    """
    try:
        return build()
    except UnreadableError as error:
        return Rejection(place, str(error))
    except ValidationError as error:
        return Rejection(place, str(document_error(place, error)))


def printable(name: str) -> str:
    """Return a name on one line, without characters that control a terminal or turn the direction of writing."""
    return " ".join("".join(char if char.isprintable() else " " for char in name).split())


def one_line(error: object, length: int = 200) -> str:
    """Return an error message of another library on one line, cut to a length."""
    return " ".join(str(error).split())[:length]


def slug(text: str) -> str:
    """Return a text as part of an experiment's id."""
    return re.sub(r"[^a-z0-9_-]+", "_", text.lower())


@dataclass(frozen=True)
class ImportSource:
    """A file or a folder of files in one format.

    Attributes:
        path: the file or folder.
        format: "openexp" (ReactXT), "chemtrans" (also ChemActor), "ord" (Open Reaction Database) or "xdl" (chemical
            description language).
        product: name of the product of XDL files that do not name it; "{stem}" stands for the file's name without its
            suffix. Other formats state their products.

    Raises:
        OptionError: the path does not exist, the format is not known, or a product is given for another format.
    """

    path: Path
    format: Format
    product: str = ""

    def __post_init__(self) -> None:
        if self.format not in get_args(Format):
            raise OptionError(f"format {self.format[:40]!r} is not known; choose one of {', '.join(get_args(Format))}")
        if self.product and self.format != "xdl":
            named = f"product {self.product[:40]!r}"
            raise OptionError(f"{named} applies to the format xdl only, not to {self.format}; leave it out")
        if not self.path.exists():
            raise OptionError(f"{self.path}: no such file or folder; name what to import")
        if not (self.path.is_file() or self.path.is_dir()):
            raise OptionError(f"{self.path}: neither a file nor a folder; name what to import")

    def files(self) -> list[Path]:
        """Return the files, in the order in which they are read.

        Raises:
            DocumentError: the folder holds no file of the format.
        """
        files: list[Path] = self._module.files(self.path) if self.path.is_dir() else [self.path]
        return files

    def records(self, file: Path) -> Iterator[Experiment | Rejection]:
        """Return the records of a file; if a file of a folder cannot be read, the last is a rejection that says why.

        Raises:
            DocumentError: a single file cannot be read; raised during iteration.
            MissingDependencyError: the format needs an extra that is not installed.
        """
        read = partial(self._module.read, product=self.product) if self.format == "xdl" else self._module.read
        if self.path.is_dir():
            yield from from_file(file, self.path, read)
        else:
            yield from read(file, self.path.parent)

    def name(self, file: Path) -> str:
        """Return the path of a file relative to the folder."""
        return file.relative_to(self.path if self.path.is_dir() else self.path.parent).as_posix()

    def digest(self, file: Path) -> str:
        """Return the SHA-256 of a file and of the files that are read with it."""
        companions = getattr(self._module, "companions", None)
        digest = hashlib.sha256()
        for each in (file, *(companions(file) if companions is not None else ())):
            with each.open("rb") as stream:
                digest.update(hashlib.file_digest(stream, "sha256").digest())
        return digest.hexdigest()

    @property
    def _module(self) -> ModuleType:
        return import_module(f"labgym.protocols.importers.{self.format}")
