"""What an asset's USD file says beyond geometry: custom attributes in the namespace `labgym`, each documented."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from labgym.assets.model import Asset, Hazards
from labgym.assets.specs import Specifications, quantity

NAMESPACE = "labgym"


@dataclass(frozen=True)
class Attribute:
    """One custom attribute of an asset's root prim.

    Attributes:
        name: without the namespace. type_name: USD's value type.
        meaning: what is written beside it in the file.
        value: what it is for an asset; None leaves it out.
    """

    name: str
    type_name: str
    meaning: str
    value: Callable[[Asset], Any]

    @property
    def full_name(self) -> str:
        """Name with the namespace."""
        return f"{NAMESPACE}:{self.name}"


_HAZARD_MEANINGS = {
    "flammable": "Catches fire easily.",
    "explosive": "May explode.",
    "volatile_or_toxic": "Gives off vapours or is toxic.",
    "glass_container": "Is a container of glass.",
    "heat_source": "Gives heat.",
    "acid": "Is or holds an acid.",
    "base": "Is or holds a base.",
    "oxidizer": "Feeds a fire with oxygen.",
    "active_metal": "Is a metal that reacts with water or air.",
}


def _hazard(name: str) -> Attribute:
    return Attribute(f"hazards:{name}", "bool", _HAZARD_MEANINGS[name], lambda asset: getattr(asset.hazards, name))


def _chemical(name: str, field: str, type_name: str, meaning: str) -> Attribute:
    def value(asset: Asset) -> Any:
        found = getattr(asset.chemistry, field) if asset.chemistry else None
        return found if found not in (None, ()) else None

    return Attribute(f"chemistry:{name}", type_name, meaning, value)


_PAIRS = [name for name, field in Specifications.model_fields.items() if "tuple[" in str(field.annotation)]
_SPEC_TYPES = {
    **dict.fromkeys(_PAIRS, "double2"),
    "bowl_m": "double3",
    "lines_nm": "double[]",
    "features": "token[]",
    **dict.fromkeys(("places", "pieces", "fire_rating_min"), "int"),
    **dict.fromkeys(("agent", "nfpa_special"), "token"),
    **dict.fromkeys(("joint", "container", "notes"), "string"),
}
"""USD type of the specifications that are no plain number."""


def _specification(name: str) -> Attribute:
    field, unit = Specifications.model_fields[name], quantity(name)[1]
    meaning = f"{field.description} Unit: {unit}." if unit else str(field.description)

    def value(asset: Asset) -> Any:
        return dict(asset.specs.given()).get(name)

    return Attribute(f"specs:{name}", _SPEC_TYPES.get(name, "double"), meaning, value)


ATTRIBUTES: tuple[Attribute, ...] = (
    Attribute("name", "string", "Canonical name in the catalogue.", lambda asset: asset.name),
    Attribute("kind", "token", "reagent, instrument or facility.", lambda asset: asset.kind),
    Attribute("category", "string", "Category in the catalogue.", lambda asset: asset.category),
    Attribute("subtype", "string", "Subtype within the category.", lambda asset: asset.subtype),
    Attribute("synonyms:en", "string[]", "English synonyms.", lambda asset: asset.synonyms_en or None),
    Attribute("synonyms:zh", "string[]", "Chinese synonyms.", lambda asset: asset.synonyms_zh or None),
    Attribute("description", "string", "What it is.", lambda asset: asset.description),
    Attribute("caption", "string", "What it is for and how it is handled, in a line.", lambda asset: asset.caption),
    Attribute("placing", "token", "Stands on the floor, on a desktop or hangs on a wall.", lambda asset: asset.placing),
    Attribute(
        "size",
        "double3",
        "Width along x, depth along y, height along z of the space it takes, metres.",
        lambda asset: (asset.size.width, asset.size.depth, asset.size.height),
    ),
    Attribute("clearance", "double", "Free depth wanted in front, metres.", lambda asset: asset.clearance or None),
    Attribute(
        "mountHeight",
        "double",
        "Height of the bottom above the floor of what hangs on a wall, metres.",
        lambda asset: asset.mount_height or None,
    ),
    Attribute("storageClass", "token", "What a storage cabinet is for.", lambda asset: asset.storage_class),
    Attribute("heatClass", "token", "Class of heat source.", lambda asset: asset.heat_class),
    *(_hazard(name) for name in Hazards.model_fields),
    _chemical("cas", "cas", "string", "CAS registry number."),
    _chemical("smiles", "smiles", "string", "Structure as SMILES."),
    _chemical("state", "state", "token", "solid, liquid or gas at room temperature."),
    _chemical("flashPoint", "flash_point", "double", "Flash point, degrees Celsius."),
    _chemical("hCodes", "h_codes", "string[]", "GHS hazard statements."),
    _chemical("groups", "groups", "string[]", "Reactivity groups."),
    _chemical("storageClass", "storage_class", "token", "Kind of cabinet that it is kept in."),
    *(_specification(name) for name in Specifications.model_fields),
)
"""Every custom attribute, in the order of the file."""


def write_attributes(prim: Any, asset: Asset) -> None:
    """Author the custom attributes that an asset has on its root prim, with their documentation."""
    from pxr import Gf, Sdf, Vt

    for attribute in ATTRIBUTES:
        value = attribute.value(asset)
        if value is None:
            continue
        type_name = Sdf.ValueTypeNames.Find(attribute.type_name)
        made = prim.CreateAttribute(attribute.full_name, type_name, True, Sdf.VariabilityUniform)
        # Two numbers would be taken for a vector whatever the type.
        exact = {"double2": Gf.Vec2d, "double3": Gf.Vec3d, "double[]": Vt.DoubleArray}.get(attribute.type_name)
        made.Set(exact(value) if exact is not None else value)
        made.SetDocumentation(attribute.meaning)
