"""OpenUSD's own validators, over a file or a text."""

from __future__ import annotations

from functools import cache
from typing import Any


def findings(stage: Any) -> tuple[str, ...]:
    """Return what all validators that usd-core brings say against a `pxr.Usd.Stage`, one line each."""
    errors = _context().Validate(stage)
    return tuple(sorted(" ".join(f"{error.GetName()}: {error.GetMessage()}".split()) for error in errors))


@cache
def _context() -> Any:
    from pxr import UsdValidation

    return UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
