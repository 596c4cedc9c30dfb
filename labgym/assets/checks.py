"""Consistency checks of a catalog: sizes, cavities, specifications, identifiers, flags, groups and names.

`check(catalog)` runs all checks; `labgym assets --check` and the tests call it. Sizes are also checked on reading.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

from labgym.assets import flags
from labgym.assets.catalog import Catalog
from labgym.assets.compatibility import rulebook
from labgym.assets.inference.bottle import CATEGORY as INFERRED_CATEGORY
from labgym.assets.model import SHELL, Asset
from labgym.assets.plausibility import faults, size_problem
from labgym.assets.search import normalize, surface_forms

TOLERANCE_M = 1e-6
MIN_CHARACTERS = 30
"""Least length of a description or caption, characters: shorter ones are not specific."""
DENSITY_RANGE_KG_M3 = (0.5, 8000.0)
"""Bounds of mass over bounding box, kg/m3: a gas balloon to solid steel."""

SHARED_FIELDS = ("kind", "category", "subtype", "placing", "hazards", "storage_class", "heat_class", "fume_hood")
"""Fields that a variant shares with the asset in whose place it stands."""


@dataclass(frozen=True)
class CatalogProblem:
    """A problem in the catalog: the asset, the field and a message."""

    asset: str
    field: str
    message: str


def check(catalog: Catalog) -> tuple[CatalogProblem, ...]:
    """Return all problems of a catalog; empty for a sound one."""
    single = tuple(problem for asset in catalog for rule in RULES for problem in rule(asset))
    return single + tuple(names_are_unique(catalog)) + tuple(variants_agree(catalog))


def cas_is_valid(number: str) -> bool:
    """Return whether a CAS registry number has the right form and check digit.

    The check digit is the sum of the other digits, each times its position from the right, modulo 10.
    """
    if re.fullmatch(r"[1-9]\d{1,6}-\d{2}-\d", number) is None:
        return False
    *body, last = (int(digit) for digit in number if digit != "-")
    return sum(place * digit for place, digit in enumerate(reversed(body), start=1)) % 10 == last


def sizes_are_plausible(asset: Asset) -> Iterator[CatalogProblem]:
    """Yield implausible sides and densities for the category."""
    problem = size_problem(asset)
    if problem is not None:
        yield CatalogProblem(asset.name, "size", problem)
    density = asset.mass / (asset.size.width * asset.size.depth * asset.size.height)
    if not DENSITY_RANGE_KG_M3[0] <= density <= DENSITY_RANGE_KG_M3[1]:
        yield CatalogProblem(
            asset.name, "mass", f"{asset.mass:g} kg in its box is {density:.3g} kg/m3; expected {DENSITY_RANGE_KG_M3}"
        )


def texts_are_complete(asset: Asset) -> Iterator[CatalogProblem]:
    """Yield short descriptions and captions, and missing names in English or Chinese."""
    for field in ("description", "caption"):
        if len(getattr(asset, field).strip()) < MIN_CHARACTERS:
            yield CatalogProblem(asset.name, field, f"shorter than {MIN_CHARACTERS} characters")
    for field in ("synonyms_en", "synonyms_zh"):
        if not getattr(asset, field):
            yield CatalogProblem(asset.name, field, "empty; give at least one")


def surfaces_fit(asset: Asset) -> Iterator[CatalogProblem]:
    """Yield surfaces outside the outline of a solid asset or the cavity of a hollow one, or above its fittings."""
    size, cavity = asset.size, asset.cavity
    if cavity is not None:
        within = abs(cavity.x) + cavity.width / 2.0 <= size.width / 2.0 + TOLERANCE_M
        within &= abs(cavity.y) + cavity.depth / 2.0 <= size.depth / 2.0 + TOLERANCE_M
        within &= 0.0 <= cavity.z0 < cavity.z1 <= size.height + TOLERANCE_M
        if not within:
            yield CatalogProblem(asset.name, "cavity", "reaches outside the bounding box")
        if not asset.surfaces:
            yield CatalogProblem(asset.name, "surfaces", "a hollow asset needs at least one surface inside")
    x, y, width, depth = (0.0, 0.0, size.width, size.depth)
    top = max([size.height, *(fitting.z1 for fitting in asset.fittings)])
    if cavity is not None:
        x, y, width, depth, top = cavity.x, cavity.y, cavity.width, cavity.depth, cavity.z1
    for slot, surface in enumerate(asset.surfaces):
        inside = abs(surface.x - x) + surface.width / 2.0 <= width / 2.0 + TOLERANCE_M
        inside &= abs(surface.y - y) + surface.depth / 2.0 <= depth / 2.0 + TOLERANCE_M
        if not inside or surface.z > top + TOLERANCE_M or (cavity is not None and surface.z < cavity.z0 - TOLERANCE_M):
            yield CatalogProblem(asset.name, f"surfaces.{slot}", "lies outside the outline or the cavity")


def headrooms_fit(asset: Asset) -> Iterator[CatalogProblem]:
    """Yield headrooms that do not end below the next shelf or the ceiling of the cavity."""
    if asset.cavity is None:
        return
    levels = sorted(surface.z for surface in asset.surfaces)
    for slot, surface in enumerate(asset.surfaces):
        above = [level - SHELL for level in levels if level > surface.z + TOLERANCE_M]
        ceiling = min([*above, asset.cavity.z1])
        if surface.headroom is None or surface.z + surface.headroom > ceiling + TOLERANCE_M:
            yield CatalogProblem(asset.name, f"surfaces.{slot}.headroom", f"must end at {ceiling:g} m or lower")


def kinds_agree(asset: Asset) -> Iterator[CatalogProblem]:
    """Yield inconsistent kinds: chemistry, placing, heat, glass, storage and hoods."""
    if (asset.kind == "reagent") != (asset.chemistry is not None):
        yield CatalogProblem(asset.name, "chemistry", "required for reagents and only for them")
    if asset.kind == "reagent" and (asset.placing != "desktop" or asset.hazards.glass_container):
        yield CatalogProblem(asset.name, "placing", "reagents must stand on surfaces and must not be glass equipment")
    if asset.hazards.heat_source != (asset.heat_class is not None):
        yield CatalogProblem(asset.name, "heat_class", "required for heat sources and only for them")
    if asset.category == "glassware" and not asset.hazards.glass_container:
        yield CatalogProblem(asset.name, "hazards.glass_container", "required for glassware")
    if asset.storage_class is not None and asset.cavity is None:
        yield CatalogProblem(asset.name, "cavity", "required for a storage cabinet")
    if asset.fume_hood and (asset.cavity is None or not asset.surfaces):
        yield CatalogProblem(asset.name, "cavity", "a fume hood requires a work surface inside")
    if asset.mount_height > 0.0 and asset.placing != "wall":
        yield CatalogProblem(asset.name, "mount_height", "only for wall-mounted assets")


def chemistry_is_sound(asset: Asset) -> Iterator[CatalogProblem]:
    """Yield wrong CAS numbers, ratings out of range, undefined groups, and flags that contradict the data."""
    chemistry = asset.chemistry
    if chemistry is None:
        return
    if chemistry.cas is not None and not cas_is_valid(chemistry.cas):
        yield CatalogProblem(asset.name, "chemistry.cas", f"{chemistry.cas!r} fails its check digit")
    if chemistry.nfpa is not None and not all(0 <= rating <= 4 for rating in chemistry.nfpa):
        yield CatalogProblem(asset.name, "chemistry.nfpa", f"{chemistry.nfpa} is not within 0 to 4")
    for group in chemistry.groups:
        if group not in rulebook().groups:
            yield CatalogProblem(asset.name, "chemistry.groups", f"{group!r} is not defined in the rule book")
    if asset.category == INFERRED_CATEGORY:
        return  # its flags follow from its structure, not from data
    carried = flags.carried(asset)
    for flag, value in flags.expected(asset).items():
        if carried[flag] != value:
            message = f"is {carried[flag]}, by its data {value}: change it or list an exception"
            yield CatalogProblem(asset.name, flag, message)


def specifications_are_plausible(asset: Asset) -> Iterator[CatalogProblem]:
    """Yield specifications that a device of that kind and size cannot have; see `labgym.assets.plausibility`."""
    yield from (CatalogProblem(asset.name, f"specs.{name}", message) for name, message in faults(asset))


def names_are_unique(catalog: Catalog) -> Iterator[CatalogProblem]:
    """Yield names and synonyms that two assets share."""
    owners: dict[str, set[str]] = defaultdict(set)
    for asset in catalog:
        for form in surface_forms(asset):
            owners[normalize(form)].add(asset.name)
    for form, names in owners.items():
        if len(names) > 1 or not form:
            yield CatalogProblem(min(names), "synonyms", f"{form!r} means {', '.join(sorted(names))}")


def variants_agree(catalog: Catalog) -> Iterator[CatalogProblem]:
    """Yield variants of missing assets or of variants, and variants that cannot take the role of their asset."""
    for asset in catalog:
        if asset.variant_of is None:
            if asset.held_out:
                yield CatalogProblem(asset.name, "held_out", "only for variants")
            continue
        role = catalog.get(asset.variant_of) if asset.variant_of in catalog else None
        if role is None or role.variant_of is not None:
            yield CatalogProblem(asset.name, "variant_of", f"{asset.variant_of!r} must be an asset that is no variant")
            continue
        for field in SHARED_FIELDS:
            if getattr(asset, field) != getattr(role, field):
                yield CatalogProblem(asset.name, field, f"differs from that of {role.name}, of which it is a variant")


RULES = (
    sizes_are_plausible,
    texts_are_complete,
    surfaces_fit,
    headrooms_fit,
    kinds_agree,
    chemistry_is_sound,
    specifications_are_plausible,
)
