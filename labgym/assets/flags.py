"""Hazard flags that follow from a reagent's data, and the listed exceptions to that rule.

The rule makes annotations comparable: a new reagent gets its flags from GHS statements, flash and boiling point and
reactive groups. Where judgement says otherwise, `flag_exceptions.json` names the reagent, the flag and the reason.
"""

from __future__ import annotations

from functools import lru_cache
from typing import ClassVar, Literal, get_args

from labgym.artefacts import artefacts
from labgym.assets.model import Asset, Chemistry
from labgym.documents import Document, Record

Flag = Literal[
    "flammable",
    "explosive",
    "volatile_or_toxic",
    "acid",
    "base",
    "oxidizer",
    "active_metal",
    "water_reactive",
    "peroxide_former",
]
FLAGS: tuple[Flag, ...] = get_args(Flag)

FLASH_LIMIT = 60.0
"""Closed-cup flash point, degrees Celsius, up to which GHS calls a liquid flammable (categories 1 to 3)."""
BOILING_LIMIT = 100.0
"""Liquids that boil at or below this count as volatile, degrees Celsius; water does not."""

_STATEMENTS: dict[Flag, tuple[str, ...]] = {
    "flammable": (
        "H220",
        "H221",
        "H222",
        "H223",
        "H224",
        "H225",
        "H226",
        "H227",
        "H228",
        "H250",
        "H251",
        "H252",
        "H260",
    ),
    "explosive": ("H200", "H201", "H202", "H203", "H204", "H205", "H240", "H241", "H242"),
    "volatile_or_toxic": (
        *("H300", "H301", "H310", "H311", "H330", "H331", "H340", "H350", "H351", "H360", "H361", "H370", "H372"),
        "EUH029",
    ),
    "oxidizer": ("H270", "H271", "H272"),
    "water_reactive": ("H260", "H261", "EUH014"),
    "peroxide_former": ("EUH019",),
}
_GROUPS: dict[Flag, frozenset[str]] = {
    "acid": frozenset({"strong_acid", "oxidizing_acid", "carboxylic_acid", "weak_acid", "lewis_acid"}),
    "base": frozenset(
        {
            "strong_base",
            "weak_base",
            "amine",
            "ammonia",
            "carbonate",
            "basic_salt",
            "sulfide",
            "cyanide",
            "hypochlorite",
        }
    ),
    "oxidizer": frozenset({"strong_oxidizer", "organic_peroxide", "nitrate_nitrite"}),
    "active_metal": frozenset({"alkali_metal", "metal_powder"}),
    "water_reactive": frozenset({"acyl_halide", "chlorosilane"}),
}


class FlagException(Record):
    """A flag that differs from the rule, and why."""

    asset: str
    flag: Flag
    value: bool
    reason: str


class FlagExceptions(Document):
    """All exceptions to the rule."""

    SCHEMA: ClassVar[str] = "labgym.flag_exceptions/1"

    exceptions: tuple[FlagException, ...]


@lru_cache(maxsize=1)
def exceptions() -> dict[tuple[str, str], FlagException]:
    """Return the listed exceptions by asset and flag."""
    document = FlagExceptions.load(artefacts("assets") / "chemistry" / "flag_exceptions.json")
    return {(item.asset, item.flag): item for item in document.exceptions}


def by_rule(chemistry: Chemistry) -> dict[Flag, bool]:
    """Return the flags that follow from a reagent's data, exceptions apart."""
    return {flag: _follows(flag, chemistry) for flag in FLAGS}


def group_flags(flag: Flag) -> frozenset[str]:
    """Return the reactive groups any of which raises a flag."""
    return _GROUPS.get(flag, frozenset())


def expected(asset: Asset) -> dict[Flag, bool]:
    """Return the flags that a reagent should carry: by rule, or by a listed exception."""
    if asset.chemistry is None:
        return {}
    listed = exceptions()
    return {
        flag: listed[asset.name, flag].value if (asset.name, flag) in listed else value
        for flag, value in by_rule(asset.chemistry).items()
    }


def carried(asset: Asset) -> dict[Flag, bool]:
    """Return the flags that a reagent carries."""
    if asset.chemistry is None:
        return {}
    hazards, chemistry = asset.hazards, asset.chemistry
    return {flag: bool(getattr(hazards if hasattr(hazards, flag) else chemistry, flag)) for flag in FLAGS}


def _follows(flag: Flag, chemistry: Chemistry) -> bool:
    # Statements may carry a suffix (H361d, H360FD), so the first part is compared.
    if any(code.startswith(statement) for code in chemistry.h_codes for statement in _STATEMENTS.get(flag, ())):
        return True
    if group_flags(flag) & set(chemistry.groups):
        return True
    if flag == "flammable":
        return chemistry.flash_point is not None and chemistry.flash_point <= FLASH_LIMIT
    if flag == "volatile_or_toxic" and chemistry.state == "liquid" and chemistry.groups != ("aqueous",):
        return chemistry.boiling_point is not None and chemistry.boiling_point <= BOILING_LIMIT
    return False
