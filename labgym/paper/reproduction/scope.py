"""The size of a study: which protocols and seeds, and which language model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from labgym.counts import MAX_SEED, whole_number
from labgym.layouts.request import check_named_once
from labgym.llm.config import LanguageModelConfig
from labgym.llm.errors import LanguageModelError
from labgym.protocols import Protocol, resolve
from labgym.protocols import protocols as library

SEEDS, QUICK_SEEDS = 3, 1
MOST_SEEDS = 1000
QUICK_PROTOCOLS = {"comparison": 8, "ablation": 5, "navigation": 5}
"""Numbers of protocols of quick studies, spread evenly over the library."""


@dataclass(frozen=True)
class Scope:
    """Protocols and seeds of the layouts of a study."""

    protocols: tuple[Protocol, ...]
    seeds: range


def scope_of(study: str, quick: bool, names: Sequence[str] = (), seed: int = 0, count: int | None = None) -> Scope:
    """Return the size of a study.

    Args:
        study: name of the study.
        quick: whether it is small.
        names: ids or files of protocols; by default all of the library, or some of them if it is quick.
        seed: first seed.
        count: number of seeds; by default 3, or 1 if it is quick.

    Raises:
        UnknownNameError: no such protocol.
        OptionError: a number is out of range, or a protocol is named twice.
    """
    count = count if count is not None else QUICK_SEEDS if quick else SEEDS
    whole_number("seeds", count, most=MOST_SEEDS)
    whole_number("seed", seed, 0, MAX_SEED - count)
    chosen = tuple(resolve(name) for name in names) if names else _spread(QUICK_PROTOCOLS[study] if quick else None)
    check_named_once([protocol.id for protocol in chosen])
    return Scope(chosen, range(seed, seed + count))


def model_name() -> str:
    """Return the name of the configured language model; empty without one.

    Raises:
        DocumentError: a variable of the configuration has an invalid value.
    """
    try:
        return LanguageModelConfig.from_environment().model
    except LanguageModelError as error:
        if error.reason != "not_configured":
            raise
        return ""


def _spread(count: int | None) -> tuple[Protocol, ...]:
    """Return all protocols, or a number of them at even distances in the order of their ids."""
    every = [library()[name] for name in sorted(library())]
    return tuple(every if count is None else [every[k * len(every) // count] for k in range(count)])
