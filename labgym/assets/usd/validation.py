"""OpenUSD's own validators."""

from __future__ import annotations

from functools import cache
from typing import Any


def findings(stage: Any) -> tuple[str, ...]:
    """Return the findings of all validators of usd-core about a `pxr.Usd.Stage`, one line each, sorted."""
    errors = _context().Validate(stage)
    return tuple(sorted(" ".join(f"{error.GetName()}: {error.GetMessage()}".split()) for error in errors))


@cache
def _context() -> Any:
    from pxr import UsdValidation

    return UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
