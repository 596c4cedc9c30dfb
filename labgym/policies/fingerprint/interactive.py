"""The source of a class of a notebook, and of the notebook's definitions that it uses."""

from __future__ import annotations

import ast
import inspect
import linecache
import types
from collections.abc import Iterable, Iterator
from typing import Any


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
