"""Names and notes of prims."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from labgym.assets.usd import NAMESPACE


def identifiers(names: Sequence[str]) -> list[str]:
    """Return names as distinct USD identifiers, in the same order."""
    from pxr import Tf

    taken: dict[str, None] = {}
    for name in names:
        plain = unique = Tf.MakeValidIdentifier(name)
        count = 1
        while unique in taken:
            count += 1
            unique = f"{plain}_{count}"
        taken[unique] = None
    return list(taken)


def write_note(prim: Any, name: str, text: str) -> None:
    """Author a custom string attribute in the namespace `labgym`."""
    from pxr import Sdf

    prim.CreateAttribute(f"{NAMESPACE}:{name}", Sdf.ValueTypeNames.String, True, Sdf.VariabilityUniform).Set(text)
