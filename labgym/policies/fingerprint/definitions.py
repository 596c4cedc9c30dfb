"""Digests of classes and functions, also of notebooks, by their source and by the variables that they use."""

from __future__ import annotations

import ast
import inspect
import linecache
import sys
import sysconfig
import types
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

from labgym.documents import canonical_hash
from labgym.errors import OptionError
from labgym.policies.fingerprint.sources import loaded_file, sources_digest
from labgym.policies.fingerprint.values import value_digest

REMEDY = "put the class into a .py file, or evaluate without a folder"


class Definitions:
    """Digests of definitions. What labgym and installed packages define counts by its name.

    The sources of labgym are in the identity of every run, the versions of packages in its provenance.

    Args:
        counted: a class that counts by its source although it is installed: that of the policy.
    """

    def __init__(self, counted: type | None = None) -> None:
        self._counted = counted
        self._active: list[object] = []

    def value(self, value: object, name: str) -> str:
        """Return the digest of a value.

        Raises:
            OptionError: the value, or a part of it, has no digest.
        """
        return value_digest(value, name, self.definition)

    def definition(self, value: Any, name: str) -> str:
        """Return the digest of a class, a function or another callable with a name in a module.

        Raises:
            OptionError: its source is not known, or a variable that it uses has no digest.
        """
        if any(value is one for one in self._active):
            return canonical_hash(["cycle", _place(value)])
        self._active.append(value)
        try:
            if isinstance(value, type):
                return canonical_hash([_place(value), [self._class(base, name) for base in value.__mro__[:-1]]])
            if isinstance(value, types.FunctionType):
                return self._function(value, name)
            return canonical_hash(["callable", _place(value)])
        finally:
            self._active.pop()

    def _class(self, kind: type, name: str) -> list[Any]:
        place, file = _place(kind), loaded_file(kind.__module__)
        if is_labgym(kind.__module__) or (is_installed(kind.__module__) and kind is not self._counted):
            return [place]
        functions = list(class_functions(kind))
        typed = functions and all(function.__code__.co_filename.startswith("<") for function in functions)
        if file is not None and not (typed and kind.__module__ == "__main__"):  # typed after `python -i script.py`
            written = [function for function in functions if Path(function.__code__.co_filename) == file]
            used = {key: item for function in written for key, item in closure_values(function).items()}
            return [place, sources_digest(file, kind.__module__), self._values(used, name), self._attributes(kind)]
        source = class_source(kind)
        if source is None:
            raise OptionError(
                f"{name}: the source of class {kind.__qualname__!r} is not known, so an edited "
                f"class would pass for the same; {REMEDY}"
            )
        attributes = self._values(class_values(kind), f"{name}: class {kind.__qualname__!r}")
        return [place, source, self._session(functions, name), attributes]

    def _attributes(self, kind: type) -> dict[str, str]:
        """Return the digests of the data attributes of a class in a file; for those without, the source counts."""
        digests = {}
        for key, value in class_values(kind).items():
            try:
                digests[key] = self.value(value, key)
            except OptionError:
                continue
        return digests

    def _function(self, function: types.FunctionType, name: str) -> str:
        file = loaded_file(function.__module__ or "")
        if function.__module__ and is_installed(function.__module__):
            return canonical_hash(["function", _place(function)])
        defaults = [self.value(item, name) for item in (function.__defaults__, function.__kwdefaults__)]
        if file is not None:
            place = [_place(function), *next(iter(function.__code__.co_positions()))]
            source = sources_digest(file, function.__module__)
            return canonical_hash([place, source, defaults, self._values(closure_values(function), name)])
        text = function_source(function)
        if text is None:
            raise OptionError(f"{name}: the source of function {function.__qualname__!r} is not known; {REMEDY}")
        return canonical_hash([text, defaults, self._session([function], name)])

    def _session(self, functions: Iterable[types.FunctionType], name: str) -> dict[str, str]:
        return self._values(session_values(functions), name)

    def _values(self, values: dict[str, Any], name: str) -> dict[str, str]:
        return {key: self._variable(values[key], f"{name}: variable {key!r}") for key in sorted(values)}

    def _variable(self, value: object, name: str) -> str:
        if not isinstance(value, types.ModuleType):
            return self.value(value, name)
        file = loaded_file(value.__name__)
        if file is None or is_installed(value.__name__):
            return value.__name__
        return sources_digest(file, value.__name__)


@cache
def is_installed(module: str) -> bool:
    """Return whether a module belongs to labgym, to the interpreter or to an installed package."""
    if is_labgym(module) or module == "__main__":
        return is_labgym(module)
    file = getattr(sys.modules.get(module), "__file__", None)
    if file is None:
        return module in sys.builtin_module_names
    paths = sysconfig.get_paths()
    roots = {Path(paths[key]).resolve() for key in ("stdlib", "platstdlib", "purelib", "platlib")}
    return any(Path(file).resolve().is_relative_to(root) for root in roots)


def is_labgym(module: str) -> bool:
    """Return whether a module is part of labgym, whose sources are in the identity of every run."""
    return module.partition(".")[0] == "labgym"


def _place(value: Any) -> str:
    return f"{value.__module__}:{getattr(value, '__qualname__', value.__name__)}"


def class_source(kind: type) -> str | None:
    """Return the source of a class that has no file, if its lines are known (as in a notebook); None otherwise."""
    for function in class_functions(kind):
        lines = linecache.getlines(function.__code__.co_filename)
        if not lines:
            continue
        node = _class_at("".join(lines), kind.__name__, function.__code__.co_firstlineno)
        if node is not None:
            return ast.unparse(node)
    return None


def function_source(function: types.FunctionType) -> str | None:
    """Return the source of a function that has no file; None if its lines are not known."""
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        return None


def session_values(functions: Iterable[types.FunctionType]) -> dict[str, Any]:
    """Return the variables of the session and of enclosing functions that some functions use, by name."""
    used: dict[str, Any] = {}
    for function in functions:
        names = set(_code_names(function.__code__))
        used |= {name: function.__globals__[name] for name in names if name in function.__globals__}
        used |= closure_values(function)
    return used


def closure_values(function: types.FunctionType) -> dict[str, Any]:
    """Return the variables of enclosing functions that a function uses, by name; `__class__` is left out."""
    values = {}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        if name == "__class__":
            continue
        try:
            values[name] = cell.cell_contents
        except ValueError:
            continue  # not assigned yet
    return values


def class_values(kind: type) -> dict[str, Any]:
    """Return the data attributes of a class, which may have been assigned after its definition."""
    values = {}
    for name, value in vars(kind).items():
        if name.startswith("__") or name == "_abc_impl":
            continue
        if isinstance(value, types.FunctionType | staticmethod | classmethod | property):
            continue
        if isinstance(value, types.MemberDescriptorType | types.GetSetDescriptorType):
            continue
        values[name] = value
    return values


def class_functions(kind: type) -> Iterator[types.FunctionType]:
    """Yield the functions in a class's own body: methods, also static and class methods, and properties."""
    for value in vars(kind).values():
        functions = (value.fget, value.fset, value.fdel) if isinstance(value, property) else (value,)
        for function in functions:
            inner = inspect.unwrap(getattr(function, "__func__", function)) if function is not None else None
            if isinstance(inner, types.FunctionType):
                yield inner


def _code_names(code: types.CodeType) -> Iterator[str]:
    yield from code.co_names
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _code_names(constant)


def _class_at(source: str, name: str, line: int) -> ast.ClassDef | None:
    """Return the innermost class of a name that contains a line."""
    try:
        tree = ast.parse(source)
    except SyntaxError:
        return None
    nodes = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.ClassDef) and node.name == name and node.lineno <= line <= (node.end_lineno or 0)
    ]
    return max(nodes, key=lambda node: node.lineno, default=None)
