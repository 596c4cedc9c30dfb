"""Exceptions of labgym: each message names the object, the value, what was expected and the remedy."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import Any


class LabgymError(Exception):
    """Base of every error that labgym raises on purpose. Always one line."""

    def __reduce__(self) -> tuple[Any, ...]:
        # Subclasses take other arguments than their message; without this none of them returns from a worker process.
        return _revived, (type(self), self.args, dict(self.__dict__))


class UnknownNameError(LabgymError, KeyError):
    """A name that does not exist, with the names that do.

    Args:
        near: the nearest names, each as it is to be shown, where a search knows better than spelling.
    """

    def __init__(self, kind: str, given: object, available: Iterable[str], near: Sequence[str] | None = None) -> None:
        names = sorted(available)
        if near is not None:
            hint = f"nearest are {', '.join(near)}" if near else "nothing is near"
            self.message = f"{kind} {str(given)[:80]!r} not found, {hint}; {len(names)} in all"
            super().__init__(self.message)
            return
        near = get_close_matches(str(given), names, n=3, cutoff=0.5)
        hint = f"nearest: {', '.join(near)}; " if near else ""
        shown = ", ".join(names[:40]) + (f", ... ({len(names)} in all)" if len(names) > 40 else "")
        self.message = f"{kind} {str(given)[:80]!r} not found; {hint}available: {shown or 'none'}"
        super().__init__(self.message)

    def __str__(self) -> str:
        return self.message


class OptionError(LabgymError, ValueError):
    """An argument outside what a function accepts."""


class DocumentError(LabgymError, ValueError):
    """A file that cannot be read as the document it should be.

    Attributes:
        file: the file as it was named.
        field: dotted path of the offending field, or "" where the whole file is at fault.
    """

    def __init__(self, file: object, field: str, problem: str) -> None:
        self.file = str(file)
        self.field = field
        where = f"{self.file}: field {field}" if field else self.file
        super().__init__(f"{where}: {problem}")


class MissingDependencyError(LabgymError, ImportError):
    """An optional package is needed and not installed."""

    def __init__(self, package: str, needed_for: str, extra: str) -> None:
        super().__init__(
            f"{needed_for} needs the package {package!r}; install it with: pip install 'labgym-nav[{extra}]'"
        )


class InfeasibleError(LabgymError):
    """A layout request that no arrangement can satisfy.

    Attributes:
        conflicts: the constraints that clash, each one sentence.
        smallest_preset: name of the smallest room preset that fits, or None.
    """

    def __init__(self, what: str, conflicts: Sequence[str], smallest_preset: str | None) -> None:
        self.conflicts = tuple(conflicts)
        self.smallest_preset = smallest_preset
        remedy = f"smallest preset that fits: {smallest_preset}" if smallest_preset else "no preset fits"
        super().__init__(f"{what}: {'; '.join(self.conflicts)}; {remedy}")


def _revived(kind: type[LabgymError], arguments: tuple[Any, ...], state: dict[str, Any]) -> LabgymError:
    error = kind.__new__(kind, *arguments)
    error.__dict__.update(state)
    return error
