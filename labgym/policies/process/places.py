"""The files that a foreign policy may read in its box: first those of its folder, then those of its identity."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterable, Iterator
from importlib.machinery import PathFinder
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from labgym.policies.fingerprint.sources import (
    imported_modules,
    is_installed_file,
    loaded_file,
    search_path,
    source_files,
)
from labgym.policies.process.box import Grants, spared
from labgym.policies.process.source import PolicySource
from labgym.policies.registry import FILES, policy_place

SHARED = ("cv2", "scipy", "stable_baselines3", "torch")
"""Packages that the host imports once for the processes of foreign policies that import them.

onnxruntime starts a thread, with which a process cannot be forked.
"""
OWN = "labgym.policies."
"""Beginning of the names of labgym's modules that the host imports once if a policy builds on them."""
OF_FILES = {
    ".safetensors": ("torch",),
    ".pt": ("torch",),
    ".torchscript": ("torch",),
    ".zip": ("torch", "stable_baselines3"),
}
"""Packages by the suffix of a policy's file."""


class OwnPlaces:
    """The files of a policy as far as they are known before its code runs.

    These are the folder of its module, the modules outside of it that these import, its file with the folder that
    holds it, and the files and folders that its options name.

    Args:
        source: not built in.
    """

    def __init__(self, source: PolicySource) -> None:
        self._hidden = source.hidden
        self._read: dict[str, None] = {}
        self._listed: dict[str, None] = {}
        self._seen: set[str] = set()
        self.shared: set[str] = set()
        """Names of the modules that the host may import for it."""
        name = () if source.pickled is not None else (source.name,)
        for text in (*name, *_texts(source.options), *source.stated):
            self._add_named(text)
        if source.pickled is not None:
            for module in (*source.modules, "__main__"):
                self._add_loaded(module)
            # A pickle names the modules that it needs.
            self.shared = {name for name in SHARED if name.encode() in source.pickled}
        elif Path(source.name).suffix.lower() not in FILES:
            self._add_module(policy_place(source.name).partition(":")[0], whole=True)

    @property
    def grants(self) -> Grants:
        """The files that the first load may read."""
        return Grants(spared(self._read, self._hidden), tuple(self._listed))

    def _add_named(self, text: str) -> None:
        path = Path(text).expanduser()
        try:
            if not path.exists():
                return
        except (OSError, ValueError):
            return
        path = path.resolve()
        # An ONNX graph may have its weights in other files of its folder.
        self._read[str(path.parent if path.suffix.lower() == ".onnx" else path)] = None
        self.shared.update(OF_FILES.get(path.suffix.lower(), ()))

    def _add_loaded(self, module: str) -> None:
        file = loaded_file(module)
        if file is None and module != "__main__":  # an object from another machine, whose modules came with it
            self._add_module(module, whole=True)
        elif file is not None and not is_installed_file(file):
            if module != "__main__":
                self._add_module(module, whole=True)
                self._read[str(file.resolve())] = None
            self._add_imports([file.resolve()], "")

    def _add_module(self, name: str, whole: bool) -> None:
        """Add a module of the Python path that is not installed, and what it imports.

        Args:
            name: of the module. whole: whether all of the folder of a module without a package belongs to the policy.
        """
        top = name.partition(".")[0]
        if top in SHARED:
            self.shared.add(top)
        elif name.startswith(OWN):
            self.shared.add(name)
        if top in self._seen or top in sys.builtin_module_names or top == "labgym":
            return
        self._seen.add(top)
        try:
            spec = find_spec(top) or PathFinder.find_spec(top, search_path())
        except (ImportError, ValueError):  # a module without a specification, such as one of a notebook
            return
        if spec is None:
            return
        folders = [Path(folder).resolve() for folder in spec.submodule_search_locations or ()]
        if any(is_installed_file(folder / "__init__.py") for folder in folders):
            return
        for folder in folders:
            self._read[str(folder)] = self._listed[str(folder.parent)] = None
            self._add_imports(folder.rglob("*.py"), top)
        file = None if folders or spec.origin is None else Path(spec.origin).resolve()
        if file is not None and file.is_file() and not is_installed_file(file):
            files = [file, *source_files(file, top).values()] if file.suffix == ".py" else [file]
            own = whole and file.parent not in _common_folders()
            self._read.update(dict.fromkeys(map(str, [file.parent] if own else files)))
            self._listed[str(file.parent)] = None
            self._add_imports([each for each in files if each.suffix == ".py"], "")

    def _add_imports(self, files: Iterable[Path], package: str) -> None:
        names = {name for file in files for name in imported_modules(file, package)}
        for name in sorted(names):
            self._add_module(name, whole=False)


def known_files(first: Grants, files: Iterable[str]) -> tuple[str, ...]:
    """Return those of the files of a policy's identity that exist and that its first load may read, sorted.

    The texts come from the first load and go to each load that drives: as paths in order, they carry nothing else.

    Args:
        first: grants of the first load. files: as the policy's process stated them, which may be untrue.
    """
    paths = {Path(file).resolve() for file in files if "\0" not in file}
    return tuple(sorted(str(path) for path in paths if path.is_file() and first.covers(path)))


def driving_grants(first: Grants, known: Iterable[str]) -> Grants:
    """Return what a policy may read when it drives: the files of its identity.

    Args:
        first: grants of the first load. known: as `known_files` returns them.
    """
    return Grants(spared(known), first.listed)


def _texts(value: Any) -> Iterator[str]:
    """Yield the texts in JSON data."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            yield from _texts(item)


def _common_folders() -> tuple[Path, ...]:
    """Return folders that hold files of everybody, or all files of a user: a module there is granted alone."""
    return tuple(map(Path.resolve, (Path("/"), Path.home(), Path("/tmp"), Path(tempfile.gettempdir()))))
