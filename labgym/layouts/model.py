"""The layout document: a floor with placements, and the protocols that it is for."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, PrivateAttr, model_validator

from labgym.assets import Asset, Catalog
from labgym.assets.model import APPARATUS_STAND
from labgym.documents import Document, Growing, canonical_hash, read_json
from labgym.errors import DocumentError, LabgymError, check_name
from labgym.geometry import OrientedBox
from labgym.layouts.floor import Floor, Identifier, Room
from labgym.layouts.placement import FLOOR, WALL, Placement, check_placements, placed_box, placed_part, resized
from labgym.layouts.records import (
    Assignments,
    EmbeddedProtocol,
    Provenance,
    Zones,
    canonical,
    zone_problem,
    zones_within,
)
from labgym.layouts.roles import with_role
from labgym.protocols import Protocol

OPEN_HEADROOM = 1000.0
"""Headroom of a surface with nothing above it, meters."""


class Layout(Document, Growing):
    """A floor with placements and the protocols that it is for. Immutable; bound to a catalog.

    The catalog is extended by the substances that the protocols embed.

    Attributes:
        protocols: the protocols that are carried out in the laboratory; the first is the one that episodes, scores and
            drawings take by default.
        floor: walls, doors and spaces.
        placements: the objects and their positions.
        provenance: how the layout was made.
        zones: functional zones.
        assignment: the zone in which the steps of a location are carried out, if the asset stands in several.
        seed_hash: SHA-256, hexadecimal, that seeds draws in the laboratory instead of its hash. The published rooms of
            `val` and `test` have it, so that their episodes are those of their first publication.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset({"zones", "assignment", "seed_hash"})
    SCHEMA: ClassVar[str] = "labgym.layout/2"

    id: Identifier
    protocols: Annotated[tuple[EmbeddedProtocol, ...], Field(max_length=5)] = ()
    floor: Floor
    placements: Annotated[tuple[Placement, ...], Field(max_length=2000)]
    provenance: Provenance = Provenance()
    zones: Zones = ()
    assignment: Assignments = ()
    seed_hash: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")] | None = None

    _catalog: Catalog = PrivateAttr()

    def __init__(self, /, *, catalog: Catalog | None = None, **fields: Any) -> None:
        """Make a layout.

        Args:
            catalog: the catalog that defines the placements' assets; by default `Catalog.load()`.
            fields: the fields of the document.

        Raises:
            pydantic.ValidationError: a field is missing, unknown or out of range.
            LabgymError: a substance that a protocol embeds clashes with the catalog.
        """
        if catalog is not None and not isinstance(catalog, Catalog):
            fields["catalog"] = catalog  # a field of that name in a document is as unknown as any other
        super().__init__(**fields)
        substances = (substance for protocol in self.protocols for substance in protocol.substances)
        self._catalog = (Catalog.load() if catalog is None else catalog).including(substances)

    @model_validator(mode="after")
    def _check_protocols(self) -> Self:
        ids = [protocol.id for protocol in self.protocols]
        if len(set(ids)) != len(ids):
            raise ValueError(f"protocols must have different ids, got {', '.join(ids)}")
        return self

    @classmethod
    def load(cls, path: str | Path, catalog: Catalog | None = None) -> Self:
        """Read a layout file.

        Args:
            path: a .json file.
            catalog: the catalog to bind the layout to; by default `Catalog.load()`.

        Raises:
            DocumentError: not a layout, or it names an asset or a support that does not exist.
        """
        return cls.parse(read_json(path), path, catalog)

    @classmethod
    def parse(cls, data: Any, source: object = "document", catalog: Catalog | None = None) -> Self:
        """Validate plain data, names included.

        Raises:
            DocumentError: names the source and the field.
        """
        if catalog is not None and isinstance(data, dict) and "catalog" not in data:
            data = {**data, "catalog": catalog}  # an argument of the constructor, no field
        try:
            layout = super().parse(data, source)
        except DocumentError:
            raise
        except LabgymError as error:
            raise DocumentError(source, "protocols", str(error)) from None
        layout.check_references(source)
        return layout

    def check_references(self, source: object = "layout") -> None:
        """Check that ids are unique, assets exist, sizes are plausible, moving parts and slots named exist.

        Raises:
            DocumentError: names the source and the first placement at fault.
        """
        check_placements(self.placements, self.catalog, source)
        if self.zones or self.assignment:
            roots = {placement.id for placement in self.placements if placement.support in (FLOOR, WALL)}
            problem = zone_problem(self.zones, self.assignment, roots)
            if problem is not None:
                raise DocumentError(source, "zones", problem)

    @property
    def catalog(self) -> Catalog:
        """The catalog that the layout is bound to."""
        return self._catalog

    @property
    def protocol(self) -> Protocol | None:
        """The first protocol, None if the layout has none."""
        return self.protocols[0] if self.protocols else None

    @property
    def protocol_id(self) -> str | None:
        """Id of the first protocol, None if the layout has none."""
        return self.protocols[0].id if self.protocols else None

    @cached_property
    def room(self) -> Room:
        """The floor's only space as a rectangular room.

        Raises:
            LabgymError: the floor is not one rectangular room.
        """
        try:
            return self.floor.room
        except LabgymError as error:
            raise LabgymError(f"layout {self.id!r}: {error}") from None

    @cached_property
    def by_id(self) -> dict[str, Placement]:
        """Placements by id."""
        return {placement.id: placement for placement in self.placements}

    @cached_property
    def hash(self) -> str:
        """SHA-256 of canonical JSON, lengths rounded to 0.1 mm and angles to 0.1 mrad.

        It covers the floor, the placements, the embedded protocols, the digests of the catalog entries that are placed,
        zones and the seed of draws. Id, provenance, the floor's name and its origin do not count, nor do fields that
        have their default value: a field added later changes no hash.
        """
        functions = {name: canonical(getattr(self, name)) for name in self.ADDED if getattr(self, name)}
        return canonical_hash(
            {
                **functions,
                "schema": self.SCHEMA,
                "floor": {
                    name: value for name, value in canonical(self.floor).items() if name not in ("name", "origin")
                },
                "placements": [canonical(placement) for placement in self.placements],
                "protocols": [p.model_dump(mode="json", exclude_defaults=True) for p in self.protocols],
                "assets": {p.asset: self.catalog.get(p.asset).digest for p in self.placements},
            }
        )

    @property
    def draw_seed(self) -> int:
        """Seed of draws in the laboratory: the first 64 bits of `seed_hash`, or of the hash if that is None."""
        return int((self.seed_hash or self.hash)[:16], 16)

    def placement(self, placement_id: str) -> Placement:
        """Return a placement by id.

        Raises:
            UnknownNameError: no placement has that id.
        """
        check_name("placement", placement_id, self.by_id)
        return self.by_id[placement_id]

    def asset(self, placement_id: str) -> Asset:
        """Return the catalog entry of a placement, with the placement's size and role if it has them.

        Raises:
            UnknownNameError: no placement has that id, or the catalog has no such asset.
        """
        asset = self._assets.get(placement_id)
        if asset is None:
            placement = self.placement(placement_id)
            asset = self.catalog.get(placement.asset)
            if placement.size is not None:
                asset = resized(asset, placement.size)
            if placement.role is not None:
                asset = with_role(asset, placement.role)
            self._assets[placement_id] = asset
        return asset

    @cached_property
    def _assets(self) -> dict[str, Asset]:
        """Catalog entries that have been asked for, by placement id."""
        return {}

    def box(self, placement_id: str) -> OrientedBox:
        """Return a placement's bounding box in the room frame."""
        box = self._boxes.get(placement_id)
        if box is None:
            box = self._boxes[placement_id] = placed_box(self.placement(placement_id), self.asset(placement_id))
        return box

    @cached_property
    def _boxes(self) -> dict[str, OrientedBox]:
        """Bounding boxes that have been computed, by placement id."""
        return {}

    def solids(self, placement_id: str) -> tuple[OrientedBox, ...]:
        """Return a placement's solid boxes in the room frame: its bounding box, or a hollow one's shell.

        A placement with a state has separate boxes for its doors and drawers.
        """
        placement, asset = self.placement(placement_id), self.asset(placement_id)
        if placement.state:
            from labgym.assets.articulation import posed_solids

            return tuple(placed_part(part, placement) for part in posed_solids(asset, placement.state))
        return tuple(placed_part(part, placement) for part in asset.solids())

    def open_parts(self, placement_id: str) -> tuple[OrientedBox, ...]:
        """Return the solids of open drawers and doors that stand out of a placement's bounding box."""
        placement = self.placement(placement_id)
        if not placement.state:
            return ()
        from labgym.assets.articulation import protruding

        boxes = protruding(self.asset(placement_id), placement.state)
        return tuple(placed_part(part, placement) for part in boxes)

    def surface(self, placement_id: str, slot: int) -> OrientedBox:
        """Return a surface of a placement as a box from its height up to its headroom (1000 m if open)."""
        placement, surface = self.placement(placement_id), self.asset(placement_id).surfaces[slot]
        top = surface.z + (surface.headroom if surface.headroom is not None else OPEN_HEADROOM)
        box = OrientedBox(surface.x, surface.y, surface.width, surface.depth, 0.0, surface.z, top)
        return placed_part(box, placement)

    def children(self, placement_id: str) -> tuple[Placement, ...]:
        """Return what stands directly on or in a placement."""
        return tuple(placement for placement in self.placements if placement.support == placement_id)

    def root(self, placement_id: str) -> Placement:
        """Return the floor or wall object that finally carries a placement; itself if it stands on the floor."""
        placement = self.placement(placement_id)
        while placement.support not in (FLOOR, WALL):
            placement = self.placement(placement.support)
        return placement

    def apparatus(self, placement_id: str) -> str | None:
        """Return the id of the stand in which a placement is assembled with others; its own if it is a stand.

        The pieces of an apparatus are one object: they are inside each other, as a flask in its bath.
        """
        if self.asset(placement_id).subtype == APPARATUS_STAND:
            return placement_id
        support = self.placement(placement_id).support
        held = support in self.by_id and self.asset(support).subtype == APPARATUS_STAND
        return support if held else None

    def all_of(self, asset: str) -> Iterator[Placement]:
        """Yield the placements of an asset and of variants of it."""
        return (p for p in self.placements if p.asset == asset or self.asset(p.id).variant_of == asset)

    def find(self, asset: str) -> Placement | None:
        """Return the first placement of an asset or of a variant of it, or None.

        If the asset is assigned to a zone, its first placement there comes before all others.
        """
        furniture = next((self.zone(one.zone) for one in self.assignment if one.location == asset), ())
        inside = (placement for placement in self.all_of(asset) if self.root(placement.id).id in furniture)
        first = next(inside, None) if furniture else None
        return next(self.all_of(asset), None) if first is None else first

    def zone(self, name: str) -> tuple[str, ...]:
        """Return the furniture of a zone; empty if no zone has that name."""
        return next((zone.furniture for zone in self.zones if zone.name == name), ())

    def obstacles(self, below: float) -> Iterator[OrientedBox]:
        """Yield bounding boxes of floor and wall objects, and their open parts, that reach below a height in meters."""
        for placement in self.placements:
            if placement.support in (FLOOR, WALL):
                box = self.box(placement.id)
                if box.z0 < below:
                    yield box
                if placement.state:
                    yield from (part for part in self.open_parts(placement.id) if part.z0 < below)

    def without(self, names: Collection[str]) -> Layout:
        """Return the layout without some placements."""
        if not names:
            return self
        return self.replace(placements=tuple(each for each in self.placements if each.id not in names))

    def replace(self, **changes: Any) -> Layout:
        """Return a copy with some fields changed, bound to the same catalog (or to `catalog=`).

        Zones lose the furniture that is removed. `seed_hash` is kept only where nothing changes that the hash covers.
        """
        catalog = changes.pop("catalog", self._catalog)
        fields = {name: getattr(self, name) for name in type(self).model_fields} | changes
        if fields["zones"]:
            fields["zones"] = zones_within(fields["zones"], {placement.id for placement in fields["placements"]})
            names = {zone.name for zone in fields["zones"]}
            fields["assignment"] = tuple(one for one in fields["assignment"] if one.zone in names)
        layout = Layout(**fields, catalog=catalog)
        if catalog is self._catalog:
            layout._take_over(self)
        if self.seed_hash is not None and "seed_hash" not in changes and layout.hash != self.hash:
            return layout.replace(seed_hash=None)
        return layout

    def _take_over(self, other: Layout) -> None:
        """Keep what another layout of the same catalog has computed for placements that both have."""
        count = len(other.placements)
        if self.placements[:count] == other.placements:
            self._assets.update(other._assets)
            self._boxes.update(other._boxes)
            return
        for placement in self.placements:
            name = placement.id
            if other.by_id.get(name) is placement:
                if name in other._assets:
                    self._assets[name] = other._assets[name]
                if name in other._boxes:
                    self._boxes[name] = other._boxes[name]

    def for_protocol(self, protocol: Protocol) -> Layout:
        """Return the layout with a protocol as its first one; the layout itself if it already is.

        A protocol of the same id is replaced; the others are kept behind it.
        """
        if self.protocols and self.protocols[0] == protocol:
            return self
        others = tuple(other for other in self.protocols if other.id != protocol.id)
        return self.replace(protocols=(protocol, *others)[:5])

    def __getstate__(self) -> dict[Any, Any]:
        # Only the fields and the catalog's reference travel to another process, not what is cached.
        state = super().__getstate__()
        fields = {name: value for name, value in state["__dict__"].items() if name in type(self).model_fields}
        return {**state, "__dict__": fields}
