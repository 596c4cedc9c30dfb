"""Hazard flags that follow from a reagent's data, and the listed exceptions to that rule.

The rule makes annotations comparable: a new reagent gets its flags from GHS statements, flash and boiling point and
reactive groups. `flag_exceptions.json` lists the reagents and flags that differ by judgment, each with the reason.
"""

from __future__ import annotations

from dataclasses import dataclass
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
    "pyrophoric",
    "peroxide_former",
]
FLAGS: tuple[Flag, ...] = get_args(Flag)

FLASH_LIMIT_C = 60.0
"""Highest closed-cup flash point of a flammable liquid under GHS (categories 1 to 3), degrees Celsius."""
BOILING_LIMIT_C = 100.0
"""Highest boiling point of a volatile liquid, degrees Celsius; water does not count."""


@dataclass(frozen=True)
class FlagRule:
    """A rule that sets a flag of a reagent that satisfies all of its conditions.

    Attributes:
        flag: the flag.
        statements: hazard statements, of which the reagent has at least one.
        groups: reactive groups, of which it has at least one.
        also: further hazard statements, of which it has at least one.
        states: states of matter, one of which it is in.
    """

    flag: Flag
    statements: tuple[str, ...] = ()
    groups: tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    states: tuple[str, ...] = ("solid", "liquid", "gas")

    def holds(self, chemistry: Chemistry) -> bool:
        """Return whether a reagent satisfies all conditions."""
        return (
            chemistry.state in self.states
            and (not self.groups or any(name in self.groups for name in chemistry.groups))
            and all(_states(chemistry, codes) for codes in (self.statements, self.also) if codes)
        )


FLUID = ("liquid", "gas")
CORROSIVE = ("H290", "H314")
CLAUSES: tuple[FlagRule, ...] = (
    # Gases, liquids and solids that burn, and those of which the GHS says that heat sets them on fire.
    FlagRule("flammable", ("H220", "H221", "H222", "H223", "H224", "H225", "H226", "H227", "H228")),
    FlagRule("flammable", ("H203", "H241", "H242", "H250", "H251", "H252", "H260")),
    FlagRule("explosive", ("H200", "H201", "H202", "H203", "H204", "H205", "H240", "H241", "H242")),
    FlagRule("explosive", groups=("azide",)),
    # Acute poisons and proven carcinogens in any state; what is suspected or harms in the long run where it evaporates.
    FlagRule("volatile_or_toxic", ("H300", "H301", "H310", "H311", "H330", "H331", "H340", "H350", "H360", "EUH029")),
    FlagRule("volatile_or_toxic", ("H351", "H361", "H370", "H372"), states=FLUID),
    # A flash point below 23 C is a vapor that can be lit at room temperature.
    FlagRule("volatile_or_toxic", ("H224", "H225"), states=("liquid",)),
    FlagRule("volatile_or_toxic", ("H314",), also=("H332", "H335"), states=("liquid",)),
    FlagRule("acid", groups=("strong_acid", "oxidizing_acid", "carboxylic_acid", "lewis_acid")),
    FlagRule("acid", CORROSIVE, groups=("weak_acid", "acidic_salt", "phenol")),
    FlagRule("base", groups=("strong_base", "weak_base", "amine", "ammonia", "carbonate", "sulfide", "cyanide")),
    FlagRule("base", groups=("hypochlorite", "organometallic")),
    FlagRule("base", ("H314", "H315", "H318", "H319"), groups=("basic_salt",)),
    FlagRule("base", CORROSIVE, groups=("hydrazine",)),
    FlagRule("base", CORROSIVE, groups=("metal_hydride",), states=("solid",)),
    FlagRule("oxidizer", ("H270", "H271", "H272")),
    FlagRule("oxidizer", groups=("strong_oxidizer", "organic_peroxide", "nitrate_nitrite")),
    FlagRule("active_metal", groups=("alkali_metal", "metal_powder")),
    FlagRule("water_reactive", ("H260", "H261", "EUH014")),
    FlagRule("water_reactive", groups=("acyl_halide", "chlorosilane", "metal_hydride")),
    FlagRule("pyrophoric", ("H232", "H250")),
    FlagRule("peroxide_former", ("EUH019",)),
)
"""All conditions for the flags, except the limits of flash and boiling point."""


class FlagException(Record):
    """A flag that differs from the rule, and the reason."""

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
    """Return the flags that follow from a reagent's data, without exceptions."""
    return {flag: _follows(flag, chemistry) for flag in FLAGS}


def group_flags(flag: Flag) -> frozenset[str]:
    """Return the reactive groups that raise a flag without further conditions."""
    alone = (clause for clause in CLAUSES if clause.flag == flag and not (clause.statements or clause.also))
    return frozenset(group for clause in alone for group in clause.groups)


def expected(asset: Asset) -> dict[Flag, bool]:
    """Return the flags that a reagent should carry: from the rules or a listed exception."""
    if asset.chemistry is None:
        return {}
    exempt = exceptions()
    return {
        flag: exempt[asset.name, flag].value if (asset.name, flag) in exempt else value
        for flag, value in by_rule(asset.chemistry).items()
    }


def carried(asset: Asset) -> dict[Flag, bool]:
    """Return the flags that a reagent carries."""
    if asset.chemistry is None:
        return {}
    hazards, chemistry = asset.hazards, asset.chemistry
    return {flag: bool(getattr(hazards if hasattr(hazards, flag) else chemistry, flag)) for flag in FLAGS}


def _states(chemistry: Chemistry, codes: tuple[str, ...]) -> bool:
    # Statements may carry a suffix (H361d, H360FD), so the first part is compared.
    return any(statement.startswith(codes) for statement in chemistry.h_codes)


def _follows(flag: Flag, chemistry: Chemistry) -> bool:
    if any(clause.holds(chemistry) for clause in CLAUSES if clause.flag == flag):
        return True
    if flag == "flammable":
        return chemistry.flash_point is not None and chemistry.flash_point <= FLASH_LIMIT_C
    if flag == "volatile_or_toxic" and chemistry.state == "liquid" and chemistry.groups != ("aqueous",):
        return chemistry.boiling_point is not None and chemistry.boiling_point <= BOILING_LIMIT_C
    return False
