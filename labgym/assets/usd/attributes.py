"""Catalogue data in an asset's USD file: documented custom attributes in the namespace `labgym`."""

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
        name: name without the namespace. type_name: USD's value type.
        meaning: documentation of the attribute in the file.
        value: function that returns an asset's value, or None to omit the attribute.
    """

    name: str
    type_name: str
    meaning: str
    value: Callable[[Asset], Any]

    @property
    def full_name(self) -> str:
        """The name with its namespace."""
        return f"{NAMESPACE}:{self.name}"


_HAZARD_MEANINGS = {
    "flammable": "Ignites easily.",
    "explosive": "May explode.",
    "volatile_or_toxic": "Emits vapors or is toxic.",
    "glass_container": "Is a glass container.",
    "heat_source": "Emits heat.",
    "acid": "Is or contains an acid.",
    "base": "Is or contains a base.",
    "oxidizer": "Supplies oxygen to a fire.",
    "active_metal": "Is a metal that reacts with water or air.",
}


def _hazard(name: str) -> Attribute:
    return Attribute(f"hazards:{name}", "bool", _HAZARD_MEANINGS[name], lambda asset: getattr(asset.hazards, name))


def _chemical(name: str, field: str, type_name: str, meaning: str) -> Attribute:
    def value(asset: Asset) -> Any:
        content = getattr(asset.chemistry, field) if asset.chemistry else None
        return content if content not in (None, ()) else None

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
"""USD type of the specifications that are not a single number."""


def _specification(name: str) -> Attribute:
    field, unit = Specifications.model_fields[name], quantity(name)[1]
    meaning = f"{field.description} Unit: {unit}." if unit else str(field.description)

    def value(asset: Asset) -> Any:
        return dict(asset.specs.items()).get(name)

    return Attribute(f"specs:{name}", _SPEC_TYPES.get(name, "double"), meaning, value)


ATTRIBUTES: tuple[Attribute, ...] = (
    Attribute("name", "string", "Canonical name in the catalogue.", lambda asset: asset.name),
    Attribute("kind", "token", "reagent, instrument or facility.", lambda asset: asset.kind),
    Attribute("category", "string", "Category in the catalogue.", lambda asset: asset.category),
    Attribute("subtype", "string", "Subtype within the category.", lambda asset: asset.subtype),
    Attribute("synonyms:en", "string[]", "English synonyms.", lambda asset: asset.synonyms_en or None),
    Attribute("synonyms:zh", "string[]", "Chinese synonyms.", lambda asset: asset.synonyms_zh or None),
    Attribute("description", "string", "Description.", lambda asset: asset.description),
    Attribute("caption", "string", "Use and handling, in one line.", lambda asset: asset.caption),
    Attribute("placing", "token", "Place: on the floor, on a desktop or on a wall.", lambda asset: asset.placing),
    Attribute(
        "size",
        "double3",
        "Width along x, depth along y and height along z of the bounding box, metres.",
        lambda asset: (asset.size.width, asset.size.depth, asset.size.height),
    ),
    Attribute("clearance", "double", "Free depth required in front, metres.", lambda asset: asset.clearance or None),
    Attribute(
        "mountHeight",
        "double",
        "Height of the bottom above the floor of a wall-mounted asset, metres.",
        lambda asset: asset.mount_height or None,
    ),
    Attribute("storageClass", "token", "Storage class that a cabinet is made for.", lambda asset: asset.storage_class),
    Attribute("heatClass", "token", "Class of heat source.", lambda asset: asset.heat_class),
    *(_hazard(name) for name in Hazards.model_fields),
    _chemical("cas", "cas", "string", "CAS registry number."),
    _chemical("smiles", "smiles", "string", "Structure as SMILES."),
    _chemical("state", "state", "token", "solid, liquid or gas at room temperature."),
    _chemical("flashPoint", "flash_point", "double", "Flash point, degrees Celsius."),
    _chemical("hCodes", "h_codes", "string[]", "GHS hazard statements."),
    _chemical("groups", "groups", "string[]", "Reactivity groups."),
    _chemical(
        "storageClass", "storage_class", "token", "Storage class: the kind of cabinet that the reagent is stored in."
    ),
    *(_specification(name) for name in Specifications.model_fields),
)
"""Every custom attribute, in the order of the file."""


def write_attributes(prim: Any, asset: Asset) -> None:
    """Author an asset's custom attributes and their documentation on its root prim."""
    from pxr import Gf, Sdf, Vt

    for attribute in ATTRIBUTES:
        value = attribute.value(asset)
        if value is None:
            continue
        type_name = Sdf.ValueTypeNames.Find(attribute.type_name)
        authored = prim.CreateAttribute(attribute.full_name, type_name, True, Sdf.VariabilityUniform)
        # USD would convert two numbers to a vector of floats.
        exact = {"double2": Gf.Vec2d, "double3": Gf.Vec3d, "double[]": Vt.DoubleArray}.get(attribute.type_name)
        authored.Set(exact(value) if exact is not None else value)
        authored.SetDocumentation(attribute.meaning)
