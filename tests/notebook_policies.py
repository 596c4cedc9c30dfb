"""Policies whose class is defined as a notebook defines it."""

from __future__ import annotations

import linecache
import sys
import types

import pytest

from labgym.policies import Policy


def notebook_policy(monkeypatch: pytest.MonkeyPatch, source: str, shown: bool = True) -> Policy:
    """Return a policy of the class `Cell` of a cell, in `__main__`.

    Args:
        monkeypatch: restores `__main__` after the test.
        source: the cell.
        shown: whether the lines of the cell are in `linecache`, as a notebook puts them there.
    """
    name = f"<cell {hash(source)} {shown}>"
    if shown:
        linecache.cache[name] = (len(source), None, source.splitlines(keepends=True), name)
    notebook = types.ModuleType("__main__")
    monkeypatch.setitem(sys.modules, "__main__", notebook)
    exec(compile(source, name, "exec"), notebook.__dict__)
    policy: Policy = notebook.Cell()
    return policy
