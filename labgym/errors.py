"""Exceptions of labgym: each message names the object, the value, what was expected and the remedy."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from typing import Any

_LINE_BREAK = re.compile(r"(?<!\s)(?=[^\S\n\r\v\f\x1c-\x1e\x85\u2028\u2029]*[\n\r\v\f\x1c-\x1e\x85\u2028\u2029])\s+")


class LabgymError(Exception):
    """Base of all errors that labgym raises deliberately; the message is one line.

    Args:
        arguments: the message; line breaks, as in values from a file, become spaces.
    """

    def __init__(self, *arguments: object) -> None:
        super().__init__(*(_LINE_BREAK.sub(" ", each) if isinstance(each, str) else each for each in arguments))

    def __reduce__(self) -> tuple[Any, ...]:
        # Subclasses take other arguments than their message; without this they could not return from a worker process.
        return _revived, (type(self), self.args, dict(self.__dict__))


MAX_LISTED = 30
"""Longest list of names that an error prints in full; of longer lists it prints the nearest names."""
NEAREST = 5


class UnknownNameError(LabgymError, KeyError):
    """A name that does not exist, with those that do: all of a short list, the nearest five of a long one.

    Args:
        kind: kind of the named object. name: the unknown name.
        available: the names that exist.
        near: the nearest names as printed, if a search finds them better than their spelling.
        remedy: further advice, added at the end.
    """

    def __init__(
        self,
        kind: str,
        name: object,
        available: Iterable[str],
        near: Sequence[str] | None = None,
        remedy: str = "",
    ) -> None:
        names = sorted(available)
        parts = []
        if near is not None:
            parts.append(f"nearest: {', '.join(near)}" if near else "no name is near")
            parts.append(f"{len(names)} in all")
        elif len(names) > MAX_LISTED:
            parts.append(f"nearest: {', '.join(_nearest(str(name), names, 0.0))}")
            parts.append(f"{len(names)} in all")
        else:
            similar = _nearest(str(name), names, 0.5)
            parts += [f"nearest: {', '.join(similar)}"] if similar else []
            parts.append(f"available: {', '.join(names) or 'none'}")
        self.message = "; ".join([self._fault(kind, str(name)[:80]), *parts, *([remedy] if remedy else [])])
        super().__init__(self.message)
        self.message = str(self.args[0])

    def __str__(self) -> str:
        return self.message

    def _fault(self, kind: str, name: str) -> str:
        return f"{kind} {name!r} not found"


def check_name(kind: str, name: object, available: Collection[str]) -> None:
    """Check that a name is one of those that exist.

    Args:
        kind: kind of the named object. available: the names that exist.

    Raises:
        UnknownNameError: it is not.
    """
    if name not in available:
        raise UnknownNameError(kind, name, available)


class UnknownArgumentError(UnknownNameError, TypeError):
    """A keyword argument that does not exist, with those that do; libraries that probe for one expect a `TypeError`.

    Args:
        kind: what takes the arguments; without a name the whole message, because Gymnasium makes a `TypeError` anew
            with a longer message. name: the unknown argument. available: the arguments that exist.
    """

    def __init__(self, kind: str, name: object = None, available: Iterable[str] = ()) -> None:
        if name is not None:
            super().__init__(kind, name, available)
        else:
            LabgymError.__init__(self, kind)
            self.message = str(self.args[0])

    def _fault(self, kind: str, name: str) -> str:
        # TorchRL and others recognize these words, which are Python's.
        return f"{kind} got an unexpected keyword argument {name!r}"


class OptionError(LabgymError, ValueError):
    """An argument that is out of range or of the wrong type."""


def refuse_idle(arguments: Iterable[tuple[str, bool, str]]) -> None:
    """Refuse the first argument that was passed and has no effect.

    Args:
        arguments: the name as the user writes it, whether it was passed and has no effect, and the reason with the
            remedy, which follows "NAME has no effect".

    Raises:
        OptionError: an argument has no effect.
    """
    for name, idle, reason in arguments:
        if idle:
            raise OptionError(f"{name} has no effect {reason}")


class DocumentError(LabgymError, ValueError):
    """A file that cannot be read as the expected document.

    Attributes:
        file: the path as passed by the caller.
        field: dotted path of the invalid field, or "" if the whole file is invalid.
    """

    def __init__(self, file: object, field: str, problem: str) -> None:
        self.file = str(file)
        self.field = field
        where = f"{self.file}: field {field}" if field else self.file
        super().__init__(f"{where}: {problem}")


class MissingDependencyError(LabgymError, ImportError):
    """A required optional package is not installed."""

    def __init__(self, package: str, needed_for: str, extra: str) -> None:
        super().__init__(
            f"{needed_for} needs the package {package!r}; install it with: pip install 'labgym-nav[{extra}]'"
        )


@contextmanager
def optional_package(package: str, needed_for: str, extra: str) -> Iterator[None]:
    """Import an optional package inside the block.

    Args:
        package: name of the distribution. needed_for: what cannot be done without it. extra: of labgym, with it.

    Raises:
        MissingDependencyError: it is not installed.
    """
    try:
        yield
    except ImportError:
        raise MissingDependencyError(package, needed_for, extra) from None


class InfeasibleError(LabgymError):
    """A layout request that cannot be satisfied.

    Attributes:
        conflicts: the conflicting constraints, one sentence each.
        smallest_preset: name of the smallest room preset that fits, None if none does.
        what: the request that cannot be satisfied. remedy: the last clause of the message.

    Args:
        remedy: the last clause of the message; by default it names the smallest preset.
    """

    def __init__(
        self, what: str, conflicts: Sequence[str], smallest_preset: str | None, remedy: str | None = None
    ) -> None:
        self.what = what
        self.conflicts = tuple(conflicts)
        self.smallest_preset = smallest_preset
        if remedy is None:
            remedy = f"smallest preset that fits: {smallest_preset}" if smallest_preset else "no preset fits"
        self.remedy = remedy
        super().__init__(
            "; ".join([f"{what}: {self.conflicts[0]}" if self.conflicts else what, *self.conflicts[1:], remedy])
        )

    def with_conflicts(self, conflicts: Sequence[str]) -> InfeasibleError:
        """Return the same error with other conflicts."""
        return type(self)(self.what, conflicts, self.smallest_preset, remedy=self.remedy)

    def with_remedy(self, remedy: str) -> InfeasibleError:
        """Return the same error with another last clause."""
        return type(self)(self.what, self.conflicts, self.smallest_preset, remedy=remedy)

    def with_preset(self, name: str | None) -> InfeasibleError:
        """Return the same error with the smallest room preset that fits, which its last clause names."""
        remedy = f"{self.remedy}; smallest preset that fits: {name}" if name else f"{self.remedy}; no preset fits"
        return type(self)(self.what, self.conflicts, name, remedy=remedy)


class SearchLimitError(InfeasibleError):
    """A search that stopped at its effort limit before it found a layout; one may exist."""


class UnrepairedError(InfeasibleError):
    """A proposed layout that still violates rules or lacks assets after its repair; another seed may give one."""


class ProposalError(UnrepairedError):
    """No layout was proposed, because a language model gave no usable answer; another seed may give one."""


class UnrepairedWarning(UserWarning):
    """A layout that violates rules or lacks required assets, and was kept because the caller asked for that."""


class SearchLimitWarning(UserWarning):
    """A laboratory with less furniture than the floor may hold, because searches stopped at their effort limit."""


def one_line(error: BaseException, longest: int) -> str:
    """Return class and message of an error in one line of at most `longest` characters."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:longest]


def _nearest(name: str, names: Sequence[str], least: float) -> list[str]:
    """Return the names that are spelled most like a name, at most five, compared without regard to case."""
    by_spelling: dict[str, list[str]] = {}
    for candidate in names:
        by_spelling.setdefault(candidate.casefold(), []).append(candidate)
    spellings = get_close_matches(name[:80].casefold(), by_spelling, n=NEAREST, cutoff=least)
    return [candidate for spelling in spellings for candidate in by_spelling[spelling]][:NEAREST]


def _revived(kind: type[LabgymError], arguments: tuple[Any, ...], state: dict[str, Any]) -> LabgymError:
    error = kind.__new__(kind, *arguments)
    error.__dict__.update(state)
    return error
