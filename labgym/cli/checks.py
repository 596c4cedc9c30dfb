"""Checks of arguments that several commands share."""

from __future__ import annotations

from importlib.util import find_spec

from labgym.errors import MissingDependencyError, OptionError


def check_at_least(least: int, **values: int) -> None:
    """Raise OptionError if a value is too small."""
    for name, value in values.items():
        if value < least:
            raise OptionError(f"{name} is {value}, expected at least {least}")


def check_installed(package: str, command: str) -> None:
    """Raise MissingDependencyError if a package of the extra `train` is not installed."""
    if find_spec(package) is None:
        raise MissingDependencyError(package, command, "train")
