"""One test over many cases, for cases that take less time than pytest takes to set up, report and tear down a test."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable
from typing import Any

import pytest


def for_each(arguments: str | tuple[str, ...], cases: Iterable[Any]) -> Callable[[Callable[..., None]], Any]:
    """Let a test run for each case; it fails with the errors of all cases that fail, each with the case's name.

    Takes the names and values of arguments as `pytest.mark.parametrize` does; other arguments are fixtures, which all
    cases share.

    Raises:
        ValueError: there are no cases.
    """
    names = (arguments,) if isinstance(arguments, str) else arguments
    rows = [(case,) if isinstance(arguments, str) else tuple(case) for case in cases]
    if not rows:
        raise ValueError(f"no cases for {', '.join(names)}")

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(test)
        def run(**fixtures: Any) -> None:
            failures: list[BaseException] = []
            for row in rows:
                try:
                    test(**dict(zip(names, row, strict=True)), **fixtures)
                except (Exception, pytest.fail.Exception) as failure:  # noqa: BLE001 - all are raised below
                    failure.add_note(f"case {getattr(row[0], 'name', row[0])}")
                    failures.append(failure)
            if failures:
                raise BaseExceptionGroup(f"{len(failures)} of {len(rows)} cases failed", failures)

        signature = inspect.signature(test)
        others = [parameter for name, parameter in signature.parameters.items() if name not in names]
        run.__signature__ = signature.replace(parameters=others)  # type: ignore[attr-defined]
        return run

    return decorate
