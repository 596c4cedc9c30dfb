"""Catalog entries: geometry, semantics, hazards and, for a reagent, its chemistry."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import Field

from labgym.assets.specs import Specifications
from labgym.documents import Record, canonical_hash
from labgym.geometry import OrientedBox

Kind = Literal["reagent", "instrument", "facility"]
Placing = Literal["floor", "desktop", "wall"]
Phase = Literal["solid", "liquid", "gas"]
HeatClass = Literal["flame", "hot_surface", "bath", "oven", "instrument"]
StorageClass = Literal[
    "Flammable",
    "Acid",
    "Base",
    "Oxidizer",
    "Toxic",
    "WaterReactive",
    "Refrigerator",
    "Gas",
    "General",
    "Glassware",
    "Waste",
]
Meters = Annotated[float, Field(ge=0.0, le=10.0)]
Length = Annotated[float, Field(gt=0.0, le=10.0)]

WORDS: dict[str, Any] = {
    **dict.fromkeys(("name", "synonyms_en", "synonyms_zh", "description", "caption", "core", "size_of"), True),
    "chemistry": {"confidence", "notes", "pyrophoric"},
    "specs": {"notes"},
    "shape": {"parameters": {"file"}},
}
"""Fields that do not enter `Asset.digest`: names and texts, `size_of`, which groups names, `shape.parameters.file`,
which is only a path, and `chemistry.pyrophoric`, which was added after the published layouts: their hashes contain
digests."""

APPARATUS_STAND = "apparatus_stand"
"""Subtype of stands; what stands in the slots of one is assembled to one apparatus."""

SHELL = 0.02
"""Thickness of the shelves of a hollow asset, meters."""


class Size(Record):
    """Bounding box in meters: width along x, depth along y (the front looks along +y), height along z."""

    width: Length
    depth: Length
    height: Length

    @property
    def short(self) -> float:
        """The shorter horizontal side."""
        return min(self.width, self.depth)

    @property
    def long(self) -> float:
        """The longer horizontal side."""
        return max(self.width, self.depth)


class Hazards(Record):
    """The nine flags of the paper (appendix A, phase 3)."""

    flammable: bool = False
    explosive: bool = False
    volatile_or_toxic: bool = False
    glass_container: bool = False
    heat_source: bool = False
    acid: bool = False
    base: bool = False
    oxidizer: bool = False
    active_metal: bool = False

    @property
    def corrosive(self) -> bool:
        """Whether it is an acid or a base."""
        return self.acid or self.base


class Surface(Record):
    """A horizontal rectangle that carries objects, in the asset's frame (origin: center of its bottom face).

    Attributes:
        x, y: center. width, depth: extents. z: height. headroom: free height above, None if open.
    """

    x: float = 0.0
    y: float = 0.0
    z: Meters
    width: Length
    depth: Length
    headroom: Length | None = None


class Cavity(Record):
    """The hollow of a cabinet, hood or glove box: an axis-aligned box in the asset's frame.

    Attributes:
        open_front: whether the front has no door (open shelving).
    """

    x: float = 0.0
    y: float = 0.0
    width: Length
    depth: Length
    z0: Meters
    z1: Length
    open_front: bool = False

    @property
    def edges(self) -> tuple[float, float, float, float]:
        """Left and right end along x, back and front end along y, meters."""
        half_width, half_depth = self.width / 2.0, self.depth / 2.0
        return self.x - half_width, self.x + half_width, self.y - half_depth, self.y + half_depth


class Fitting(Record):
    """A solid box outside an asset's bounding box, in the asset's frame: a tap above a worktop, the rod of a stand.

    Attributes:
        x, y: center. width, depth: extents. z0, z1: bottom and top.
    """

    x: float = 0.0
    y: float = 0.0
    width: Length
    depth: Length
    z0: Meters
    z1: Length


class Shape(Record):
    """Name of a parametric shape of `labgym.assets.shapes` and its parameters."""

    name: str
    parameters: dict[str, float | str | bool] = Field(default_factory=dict)


class Chemistry(Record):
    """Identity, physical data and hazards of a reagent. Temperatures in degrees Celsius, density in g/mL.

    Attributes:
        pyrophoric: whether it ignites in air as it is sold (GHS statement H250).
    """

    cas: str | None = None
    smiles: str | None = None
    formula: str | None = None
    molar_mass: float | None = None
    state: Phase
    density: float | None = None
    boiling_point: float | None = None
    flash_point: float | None = None
    nfpa: tuple[int, int, int] | None = None
    h_codes: tuple[str, ...] = ()
    water_reactive: bool = False
    pyrophoric: bool = False
    peroxide_former: bool = False
    groups: tuple[str, ...] = ()
    storage_class: StorageClass
    confidence: Literal["high", "medium", "low"] = "medium"
    notes: str = ""


class Asset(Record):
    """One entity of the catalog.

    Attributes:
        name: canonical CamelCase name.
        kind: reagent, instrument or facility (furniture, storage, safety and building elements).
        surfaces: surfaces that carry objects, by slot: a bench has one, a cabinet one per shelf.
        cavity: set for hollow assets; their solids are then walls, floor, top and shelves.
        fittings: solids outside the bounding box, which does not include them.
        storage_class: storage class that a cabinet is made for.
        heat_class: class of heat source; None for other assets.
        clearance: free depth required in front, meters.
        mount_height: height of the bottom above the floor of a wall-mounted asset, meters.
        variant_of: the asset in whose place this one may stand: the same role in another shape, size or color.
        held_out: whether a variant is only for test floors.
        size_of: the asset of which this one is another size. Protocols choose among sizes; furnishers of floors never
            do, so a size changes no floor.
    """

    name: Annotated[str, Field(pattern=r"^[A-Z][A-Za-z0-9]{1,63}$")]
    kind: Kind
    category: str
    subtype: str
    synonyms_en: tuple[str, ...] = ()
    synonyms_zh: tuple[str, ...] = ()
    description: str
    caption: str
    size: Size
    mass: Annotated[float, Field(gt=0.0, le=5000.0)]
    placing: Placing
    hazards: Hazards = Hazards()
    surfaces: tuple[Surface, ...] = ()
    cavity: Cavity | None = None
    fittings: tuple[Fitting, ...] = ()
    storage_class: StorageClass | None = None
    heat_class: HeatClass | None = None
    fume_hood: bool = False
    clearance: Meters = 0.0
    mount_height: Meters = 0.0
    shape: Shape
    specs: Specifications = Specifications()
    chemistry: Chemistry | None = None
    core: bool = False
    variant_of: str | None = None
    held_out: bool = False
    size_of: str | None = None

    @property
    def family(self) -> str:
        """Name of the asset of which it is a size, or its own."""
        return self.size_of or self.name

    @property
    def role(self) -> str:
        """Name of the asset whose role it has: the one that it is a variant of, or its own."""
        return self.variant_of or self.name

    @property
    def phase(self) -> Phase | None:
        """State of matter of a reagent; None for other assets."""
        return None if self.chemistry is None else self.chemistry.state

    @property
    def groups(self) -> tuple[str, ...]:
        """Reactive groups of a reagent; none for other assets."""
        return () if self.chemistry is None else self.chemistry.groups

    @property
    def smiles(self) -> str:
        """Structure of a reagent; "" if it is not known, and for other assets."""
        return "" if self.chemistry is None else self.chemistry.smiles or ""

    @property
    def formula(self) -> str:
        """Molecular formula of a reagent; "" if it is not known, and for other assets."""
        return "" if self.chemistry is None else self.chemistry.formula or ""

    @property
    def boiling_point(self) -> float | None:
        """Boiling point of a reagent, degrees Celsius; None if it is not known, and for other assets."""
        return None if self.chemistry is None else self.chemistry.boiling_point

    @cached_property
    def digest(self) -> str:
        """SHA-256 of everything that decides geometry, physics and chemistry.

        It covers kind, size, mass, solids, surfaces, shape (for an imported mesh the hash of its geometry), placing,
        clearance, hazards, specifications and chemistry, but not `WORDS`: name, synonyms, texts, notes and the
        flag `pyrophoric`. Fields that have their default value do not enter, so a field added with a default changes
        no digest.
        """
        solids = [[round(value, 6) for value in vars(solid).values()] for solid in self.solids()]
        return canonical_hash(
            {"entry": self.model_dump(mode="json", exclude=WORDS, exclude_defaults=True), "solids": solids}
        )

    def __hash__(self) -> int:
        return hash(self.digest)

    def solids(self, closed: bool = True) -> tuple[OrientedBox, ...]:
        """Return the solid boxes in the asset's frame: the bounding box or a hollow asset's shell, and the fittings.

        Args:
            closed: whether the front of a hollow asset with doors is solid.
        """
        fittings = tuple(OrientedBox(f.x, f.y, f.width, f.depth, 0.0, f.z0, f.z1) for f in self.fittings)
        return (*self._body(closed), *fittings)

    def _body(self, closed: bool) -> tuple[OrientedBox, ...]:
        size, cavity = self.size, self.cavity
        if cavity is None:
            return (OrientedBox(0.0, 0.0, size.width, size.depth, 0.0, 0.0, size.height),)
        left, right, back, front = cavity.edges
        half_width, half_depth = size.width / 2.0, size.depth / 2.0
        spans = [
            (-half_width, half_width, -half_depth, half_depth, 0.0, cavity.z0),
            (-half_width, half_width, -half_depth, half_depth, cavity.z1, size.height),
            (-half_width, left, -half_depth, half_depth, cavity.z0, cavity.z1),
            (right, half_width, -half_depth, half_depth, cavity.z0, cavity.z1),
            (left, right, -half_depth, back, cavity.z0, cavity.z1),
        ]
        if closed and not cavity.open_front:
            spans.append((left, right, front, half_depth, cavity.z0, cavity.z1))
        spans.extend(
            (left, right, back, front, surface.z - SHELL, surface.z)
            for surface in self.surfaces
            if cavity.z0 + SHELL < surface.z < cavity.z1
        )
        return tuple(
            OrientedBox((x0 + x1) / 2.0, (y0 + y1) / 2.0, x1 - x0, y1 - y0, 0.0, z0, z1)
            for x0, x1, y0, y1, z0, z1 in spans
            if x1 - x0 > 1e-6 and y1 - y0 > 1e-6 and z1 - z0 > 1e-6
        )
