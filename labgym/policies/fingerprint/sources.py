"""The source files of a class: its module, the modules that it imports from the same folder, and files that they name.

Nothing is imported. A file is named by a text in the source that is its path, relative to the module or to the folder.
"""

from __future__ import annotations

import ast
import os
import site
import sys
import sysconfig
from collections.abc import Iterator
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path

import labgym
from labgym.documents import canonical_hash, files_digest

MODULES = "LABGYM_MODULES"
"""Environment variable with a folder of modules that the processes of policies import. Others only look for files
there: their imports, such as an optional package that is not installed, must not come from a policy's folder."""
LONGEST = 255
"""Longest text that is tried as a path, characters."""


def search_path() -> list[str]:
    """Return the Python path of the processes of policies."""
    return [*sys.path, *filter(None, [os.environ.get(MODULES)])]


def module_file(name: str) -> Path | None:
    """Return the source file of a module without importing it; None if the Python path has no such file."""
    search = search_path()
    spec: ModuleSpec | None = None
    for depth in range(name.count(".") + 1):
        spec = PathFinder.find_spec(name.split(".")[depth], search)
        if spec is None:
            return None
        search = list(spec.submodule_search_locations or ())
    return Path(spec.origin) if spec is not None and spec.origin and spec.origin.endswith(".py") else None


def loaded_file(module: str) -> Path | None:
    """Return the source file of an imported module; None if it has none, such as `__main__` of a notebook."""
    file = getattr(sys.modules.get(module), "__file__", None)
    return Path(file) if file and str(file).endswith(".py") and Path(file).is_file() else None


def sources_digest(file: Path, module: str) -> str:
    """Return a digest of a module's file and of the modules of the same folder that it imports, directly or not.

    A module in a package counts with the modules of the same package, one of a folder with those in the folder. What
    else it imports is installed: its versions are in the provenance, not here.
    """
    files = source_files(file, module)
    return canonical_hash([[place, files_digest([path])] for place, path in sorted(files.items())])


def source_files(file: Path, module: str) -> dict[str, Path]:
    """Return the files of `sources_digest`, by path relative to the folder."""
    file = file.resolve()
    package = "" if module == "__main__" else module.rpartition(".")[0]
    if file.name == "__init__.py":
        package = module
    root = file.parents[package.count(".") + 1] if package else file.parent
    within = package.partition(".")[0]
    if not package and _is_installed(root):
        return {file.name: file}
    sources: dict[str, Path] = {}
    remaining = [(file, package)]
    while remaining:
        path, parent = remaining.pop()
        place = path.relative_to(root).as_posix()
        if place in sources:
            continue
        sources[place] = path
        tree = _parsed(path)
        for name in _imports(tree, parent):
            if not within or name.partition(".")[0] == within:
                remaining += _resolved(root, name)
        for named in _named_files(tree, path.parent, root):
            sources.setdefault(named.relative_to(root).as_posix(), named)
    return sources


def imported_modules(file: Path, package: str) -> frozenset[str]:
    """Return the absolute names of the modules, and of their members, that a source file may import, wherever in it."""
    return frozenset(_imports(_parsed(file), package))


def package_folders() -> list[str]:
    """Return the folders of the interpreter's library and of installed packages, also those that a .pth file adds."""
    paths = sysconfig.get_paths()
    folders = [paths[key] for key in ("stdlib", "platstdlib", "purelib", "platlib")]
    folders += [*site.getsitepackages(), site.getusersitepackages()]
    return [*folders, *(entry for entry in sys.path if Path(entry).name in ("site-packages", "dist-packages"))]


def is_installed_file(file: Path) -> bool:
    """Return whether a file belongs to labgym, to the interpreter or to an installed package."""
    roots = (*(Path(folder).resolve() for folder in package_folders()), Path(labgym.__file__).resolve().parent)
    file = file.resolve()
    return any(file.is_relative_to(root) for root in roots)


def _parsed(path: Path) -> ast.Module:
    try:
        return ast.parse(path.read_bytes())
    except (SyntaxError, ValueError):
        return ast.Module([], [])


def _named_files(tree: ast.Module, *folders: Path) -> Iterator[Path]:
    """Yield the files in the last of some folders that a text of a source names, relative to one of them."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Constant) or not isinstance(node.value, str) or not 0 < len(node.value) <= LONGEST:
            continue
        for folder in folders:
            try:
                file = (folder / node.value).resolve()
                named = file.is_relative_to(folders[-1]) and file.suffix != ".py" and file.is_file()
            except (OSError, ValueError, RuntimeError):
                continue
            if named:
                yield file


def _imports(tree: ast.Module, package: str) -> Iterator[str]:
    """Yield the absolute names of the modules that a file may import, wherever in it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parts = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*filter(None, parts), *([node.module] if node.module else [])])
            if base:
                yield base
            yield from (f"{base}.{alias.name}" if base else alias.name for alias in node.names)


def _resolved(root: Path, name: str) -> list[tuple[Path, str]]:
    """Return the files that an import of a module runs under a folder, each with its package."""
    files = []
    parts = name.split(".")
    for depth in range(1, len(parts) + 1):
        place, package = root.joinpath(*parts[:depth]), ".".join(parts[:depth])
        if (place / "__init__.py").is_file():
            files.append((place / "__init__.py", package))
        elif place.with_name(place.name + ".py").is_file():
            files.append((place.with_name(place.name + ".py"), ".".join(parts[: depth - 1])))
    return files


def _is_installed(folder: Path) -> bool:
    """Return whether a folder is one of the interpreter's, such as site-packages."""
    paths = sysconfig.get_paths()
    return any(folder == Path(paths[key]).resolve() for key in ("stdlib", "platstdlib", "purelib", "platlib"))
