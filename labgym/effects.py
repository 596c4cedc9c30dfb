"""Arguments that other arguments leave without effect; passing one is an error."""

from __future__ import annotations

from collections.abc import Iterable

from labgym.errors import OptionError


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
