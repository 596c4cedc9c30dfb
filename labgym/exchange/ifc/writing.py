"""Writes layouts as IFC4 building models in meters."""

from __future__ import annotations

import math
import re
import uuid
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labgym import __version__
from labgym.assets import Asset
from labgym.documents import write_text
from labgym.errors import OptionError, optional_package
from labgym.exchange.schedule import UNITS, Demand, amount_of, demands, services_of, space_of
from labgym.exchange.structure import PlacedOpening, openings, outline
from labgym.geometry import OrientedBox
from labgym.geometry.polygons import polygons
from labgym.layouts import Layout
from labgym.layouts.floor.walls import extensions
from labgym.layouts.placement import FLOOR, WALL

if TYPE_CHECKING:
    from shapely import Polygon

Entity = Any
Pose = tuple[float, float, float]
NAMESPACE = uuid.UUID("7a0f2c1e-52f3-5d0b-9c0a-6b1f5f0a9d11")
"""Namespace of the identifiers of labgym's models."""
LEAF_M = 0.04
"""Thickness of door leaves and panes."""
POINT_M = 0.1
"""Side of the box that stands for a service point."""
CLASSES = {
    "sink": ("IfcSanitaryTerminal", "SINK"),
    "shower": ("IfcSanitaryTerminal", "SHOWER"),
    "eyewash": ("IfcSanitaryTerminal", "USERDEFINED"),
    "refrigerator": ("IfcElectricAppliance", "REFRIGERATOR"),
    "freezer": ("IfcElectricAppliance", "FREEZER"),
    "fire": ("IfcFireSuppressionTerminal", "USERDEFINED"),
    "ventilation": ("IfcFurniture", "USERDEFINED"),
    "seat": ("IfcFurniture", "CHAIR"),
    "desk": ("IfcFurniture", "DESK"),
    "workbench": ("IfcFurniture", "TABLE"),
}
"""IFC classes and predefined types of floor and wall objects by subtype."""
FURNITURE = ("furniture", "storage", "transport", "waste")
"""Categories of other objects that are furniture; the rest are building element proxies."""
POINTS = {
    "water": ("IfcValve", "ISOLATING"),
    "gas": ("IfcValve", "GASCOCK"),
    "exhaust": ("IfcAirTerminal", "GRILLE"),
    "power": ("IfcOutlet", "POWEROUTLET"),
}
"""IFC classes and predefined types of service points."""
STAMP = "1970-01-01T00:00:00"
"""Time in the header: equal layouts give equal bytes."""


def write_ifc(layout: Layout, path: str | Path) -> Path:
    """Write a layout as an IFC4 building model (STEP file) and return the path.

    Spaces, walls with openings, doors and windows, columns, service points, and every object with its solids, size and
    the property sets `Labgym_Object`, `Labgym_Hazards` and `Labgym_Services`. Identifiers follow from the layout's
    hash. The site is placed so that world coordinates are those of the file that the floor was read from.

    Raises:
        OptionError: the path does not end in .ifc.
        MissingDependencyError: ifcopenshell is not installed.
    """
    path = Path(path)
    if path.suffix.lower() != ".ifc":
        raise OptionError(f"building model {path.name!r} must end in .ifc")
    with optional_package("ifcopenshell", "building models (IFC)", "bim"):
        import ifcopenshell
    text: str = _Writer(layout, ifcopenshell.file(schema="IFC4")).model.to_string()
    return write_text(path, re.sub(r"(?m)^FILE_NAME\(.*\);$", _file_name(path.name), text, count=1))


def _file_name(name: str) -> str:
    plain = re.sub(r"[^A-Za-z0-9_. -]", "_", name)
    return f"FILE_NAME('{plain}','{STAMP}',(''),(''),'labgym {__version__}','labgym {__version__}','');"


class _Writer:
    """Fills a model with a layout."""

    def __init__(self, layout: Layout, model: Any) -> None:
        self.layout, self.model = layout, model
        self._types: dict[tuple[Any, ...], tuple[Entity, Entity]] = {}
        self._typed: dict[int, list[Entity]] = {}
        self._zero = self._new("IfcCartesianPoint", (0.0, 0.0, 0.0))
        self._up, self._ahead = self._new("IfcDirection", (0.0, 0.0, 1.0)), self._new("IfcDirection", (1.0, 0.0, 0.0))
        self._flat = self._new("IfcAxis2Placement2D", self._new("IfcCartesianPoint", (0.0, 0.0)), None)
        world = self._axes((0.0, 0.0, 0.0))
        context = self._new("IfcGeometricRepresentationContext", None, "Model", 3, 1e-5, world, None)
        self._contexts = {
            name: self._new(
                "IfcGeometricRepresentationSubContext", name, "Model", None, None, None, None, context, None, view, None
            )
            for name, view in (("Body", "MODEL_VIEW"), ("Axis", "GRAPH_VIEW"))
        }
        project = self._root("IfcProject", "project", layout.id)
        project.RepresentationContexts, project.UnitsInContext = [context], self._units()
        site = self._root("IfcSite", "site", "Site", ObjectPlacement=self._place(None, layout.floor.origin))
        site.CompositionType = "ELEMENT"
        building = self._root("IfcBuilding", "building", "Building", ObjectPlacement=self._place(site, (0.0, 0.0, 0.0)))
        building.CompositionType = "ELEMENT"
        self.storey = self._root("IfcBuildingStorey", "storey", layout.floor.name)
        self.storey.ObjectPlacement = self._place(building, (0.0, 0.0, 0.0))
        self.storey.CompositionType, self.storey.Elevation = "ELEMENT", 0.0
        for whole, part in ((project, site), (site, building), (building, self.storey)):
            self._relate("IfcRelAggregates", whole, [part])
        self._contained: dict[str, list[Entity]] = {}
        self._spaces()
        self._walls()
        self._columns()
        self._points()
        self._objects()
        self._finish()

    def _units(self) -> Entity:
        units = [
            self._new("IfcSIUnit", UnitType=kind, Prefix=prefix, Name=name)
            for kind, prefix, name in (
                ("LENGTHUNIT", None, "METRE"),
                ("AREAUNIT", None, "SQUARE_METRE"),
                ("VOLUMEUNIT", None, "CUBIC_METRE"),
                ("PLANEANGLEUNIT", None, "RADIAN"),
                ("MASSUNIT", "KILO", "GRAM"),
                ("POWERUNIT", None, "WATT"),
            )
        ]
        return self._new("IfcUnitAssignment", units)

    def _spaces(self) -> None:
        spaces = []
        for space in self.layout.floor.spaces:
            solids = [self._prism(part, 0.0, space.ceiling) for part in polygons(outline(space))]
            entity = self._root("IfcSpace", f"space {space.id}", space.id, LongName=space.use)
            entity.CompositionType, entity.PredefinedType = "ELEMENT", "INTERNAL"
            entity.ObjectPlacement = self._place(self.storey, (0.0, 0.0, 0.0))
            entity.Representation = self._shape([("Body", "SweptSolid", solids)])
            self._properties(entity, "Labgym_Space", {"Use": space.use, "Ceiling": ("IfcLengthMeasure", space.ceiling)})
            self._quantities(
                entity,
                "Qto_SpaceBaseQuantities",
                [("IfcQuantityArea", "NetFloorArea", space.area), ("IfcQuantityLength", "Height", space.ceiling)],
            )
            spaces.append(entity)
            self._contained[space.id] = []
        self._relate("IfcRelAggregates", self.storey, spaces)
        self._space = {space.id: entity for space, entity in zip(self.layout.floor.spaces, spaces, strict=True)}

    def _walls(self) -> None:
        floor = self.layout.floor
        walls = []
        for number, (wall, (before, after)) in enumerate(zip(floor.walls, extensions(floor.walls), strict=True)):
            entity = self._root("IfcWall", f"wall {number}", f"wall {number}", PredefinedType="SOLIDWALL")
            entity.ObjectPlacement = self._place(self.storey, (*wall.start, wall.yaw))
            points = [self._new("IfcCartesianPoint", (along, 0.0)) for along in (0.0, wall.length)]
            axis = self._new("IfcPolyline", points)
            middle, length = (wall.length + after - before) / 2.0, wall.length + before + after
            body = self._box(OrientedBox(middle, 0.0, length, wall.thickness, 0.0, 0.0, wall.height))
            entity.Representation = self._shape([("Axis", "Curve2D", [axis]), ("Body", "SweptSolid", [body])])
            exterior = any(way.wall == number and way.exit for way in floor.doorways)
            self._properties(entity, "Pset_WallCommon", {"IsExternal": exterior} if exterior else {})
            walls.append(entity)
        self._keep(walls)
        for number, placed in enumerate(openings(floor)):
            self._opening(number, placed, walls[placed.wall])

    def _opening(self, number: int, placed: PlacedOpening, wall: Entity) -> None:
        """Add an opening, and the door or the window in it; a passage is an opening alone."""
        opening, name = placed.opening, f"{placed.opening.kind} {number}"
        void = self._root("IfcOpeningElement", f"opening {number}", name, PredefinedType="OPENING")
        void.ObjectPlacement = self._place(wall, (opening.position, 0.0, 0.0), opening.sill)
        body = OrientedBox(0.0, 0.0, opening.width, placed.thickness + 0.02, 0.0, 0.0, opening.height)
        void.Representation = self._shape([("Body", "SweptSolid", [self._box(body)])])
        self._new(
            "IfcRelVoidsElement",
            self._guid(f"voids {number}"),
            RelatingBuildingElement=wall,
            RelatedOpeningElement=void,
        )
        if opening.kind == "passage":
            return
        kind = "IfcDoor" if opening.kind == "door" else "IfcWindow"
        filling = self._root(kind, f"filling {number}", name)
        filling.OverallHeight, filling.OverallWidth = opening.height, opening.width
        turn = 0.0
        if opening.kind == "door":
            filling.PredefinedType = "DOOR"
            # The leaf opens along the y axis of the door; left and right are those of somebody who looks that way.
            turn = 0.0 if placed.side > 0 else math.pi
            left = (placed.side > 0) == (opening.hinge == "start")
            filling.OperationType = "SINGLE_SWING_LEFT" if left else "SINGLE_SWING_RIGHT"
        else:
            filling.PredefinedType = "WINDOW"
        filling.ObjectPlacement = self._place(void, (0.0, 0.0, turn))
        leaf = OrientedBox(0.0, 0.0, opening.width, LEAF_M, 0.0, 0.0, opening.height)
        filling.Representation = self._shape([("Body", "SweptSolid", [self._box(leaf)])])
        self._new(
            "IfcRelFillsElement",
            self._guid(f"fills {number}"),
            RelatingOpeningElement=void,
            RelatedBuildingElement=filling,
        )
        if opening.kind == "door":
            ways = self.layout.floor.doorways
            exits = any(way.exit and way.wall == placed.wall and way.opening == opening for way in ways)
            self._properties(filling, "Pset_DoorCommon", {"FireExit": exits, "IsExternal": exits})
        self._keep([filling])

    def _columns(self) -> None:
        top = max(space.ceiling for space in self.layout.floor.spaces)
        for column in self.layout.floor.columns:
            entity = self._root("IfcColumn", f"column {column.id}", column.id, PredefinedType="COLUMN")
            entity.ObjectPlacement = self._place(self.storey, (column.x, column.y, column.yaw))
            body = self._box(OrientedBox(0.0, 0.0, column.width, column.depth, 0.0, 0.0, top))
            entity.Representation = self._shape([("Body", "SweptSolid", [body])])
            self._keep([entity])

    def _points(self) -> None:
        for number, point in enumerate(self.layout.floor.services):
            kind, predefined = POINTS[point.kind]
            entity = self._root(kind, f"service {number}", f"{point.kind} {number}", PredefinedType=predefined)
            entity.ObjectPlacement = self._place(self.storey, (point.x, point.y, 0.0), point.z)
            body = self._box(OrientedBox(0.0, 0.0, POINT_M, POINT_M, 0.0, 0.0, POINT_M))
            entity.Representation = self._shape([("Body", "SweptSolid", [body])])
            values: dict[str, Any] = {"Service": point.kind, "Required": point.required}
            if point.reach is not None:
                values["Reach"] = ("IfcLengthMeasure", point.reach)
            self._properties(entity, "Labgym_ServicePoint", values)
            self._keep([entity])

    def _objects(self) -> None:
        needed: dict[str, list[Demand]] = {}
        for demand in demands(self.layout):
            needed.setdefault(demand.id, []).append(demand)
        for placement in self.layout.placements:
            asset, box = self.layout.asset(placement.id), self.layout.box(placement.id)
            kind, predefined = _ifc_class(asset, placement.support)
            entity = self._root(kind, f"object {placement.id}", placement.id, PredefinedType=predefined)
            entity.ObjectType = asset.name
            entity.ObjectPlacement = self._place(self.storey, (box.x, box.y, placement.yaw), box.z0)
            style, shape = self._type_of(asset, kind, predefined)
            entity.Representation = self._mapped(shape)
            self._typed.setdefault(style.id(), []).append(entity)
            supplies: dict[str, Any] = {}
            for demand in needed.get(placement.id, ()):
                supplies[demand.service.capitalize()] = demand.status
            if supplies:
                self._properties(entity, "Labgym_Connections", supplies)
            self._keep([entity], space_of(self.layout, placement.id))

    def _type_of(self, asset: Asset, kind: str, predefined: str) -> tuple[Entity, Entity]:
        """Return the type of an asset in one size, and its shape."""
        size = (asset.size.width, asset.size.depth, asset.size.height)
        key = (kind, asset.name, size)
        if key not in self._types:
            items = [self._box(solid) for solid in asset.solids()]
            body = self._new("IfcShapeRepresentation", self._contexts["Body"], "Body", "SweptSolid", items)
            shape = self._new("IfcRepresentationMap", self._axes((0.0, 0.0, 0.0)), body)
            label = f"type {kind} {asset.name} {size}"
            style = self._root(f"{kind}Type", label, asset.name, PredefinedType=predefined, RepresentationMaps=[shape])
            style.Description, style.ElementType = asset.description, asset.subtype
            if kind == "IfcFurniture":
                style.AssemblyPlace = "NOTDEFINED"
            self._type_properties(style, label, asset)
            self._types[key] = style, shape
        return self._types[key]

    def _type_properties(self, style: Entity, label: str, asset: Asset) -> None:
        lengths = zip(("Width", "Depth", "Height"), asset.size.model_dump().values(), strict=True)
        sets: dict[str, dict[str, Any]] = {
            "Labgym_Object": {
                **{name: ("IfcLengthMeasure", float(value)) for name, value in lengths},
                "Mass": ("IfcMassMeasure", asset.mass),
                "Category": asset.category,
                "Subtype": asset.subtype,
            },
            "Labgym_Hazards": _hazards(asset),
            "Labgym_Services": _services(asset),
        }
        style.HasPropertySets = [
            self._property_set(f"{label} {name}", name, values) for name, values in sets.items() if values
        ]

    def _finish(self) -> None:
        """Relate the objects to their types, and everything to the storey or its space."""
        for style, _ in self._types.values():
            self._new(
                "IfcRelDefinesByType",
                self._guid(f"defines {style.GlobalId}"),
                RelatedObjects=self._typed[style.id()],
                RelatingType=style,
            )
        for name, elements in self._contained.items():
            if elements:
                self._new(
                    "IfcRelContainedInSpatialStructure",
                    self._guid(f"contained {name}"),
                    RelatedElements=elements,
                    RelatingStructure=self._space.get(name, self.storey),
                )

    def _keep(self, elements: Iterable[Entity], space: str = "") -> None:
        self._contained.setdefault(space, []).extend(elements)

    def _guid(self, key: str) -> str:
        from ifcopenshell.guid import compress

        return str(compress(uuid.uuid5(NAMESPACE, f"{self.layout.hash} {self.layout.id} {key}").hex))

    def _root(self, kind: str, key: str, name: str, **fields: Any) -> Entity:
        return self.model.create_entity(kind, GlobalId=self._guid(key), Name=name, **fields)

    def _new(self, kind: str, *values: Any, **fields: Any) -> Entity:
        return self.model.create_entity(kind, *values, **fields)

    def _relate(self, kind: str, whole: Entity, parts: Sequence[Entity]) -> None:
        guid = self._guid(f"{kind} {whole.GlobalId}")
        self._new(kind, guid, RelatingObject=whole, RelatedObjects=list(parts))

    def _properties(self, entity: Entity, name: str, values: Mapping[str, Any]) -> None:
        if values:
            key = f"{name} {entity.GlobalId}"
            sets = self._property_set(key, name, values)
            guid = self._guid(f"defines {key}")
            fields = {"RelatedObjects": [entity], "RelatingPropertyDefinition": sets}
            self._new("IfcRelDefinesByProperties", guid, **fields)

    def _property_set(self, key: str, name: str, values: Mapping[str, Any]) -> Entity:
        """Return a property set of texts, truth values, numbers, and pairs of a measure and a value."""
        plain = {bool: "IfcBoolean", str: "IfcLabel", float: "IfcReal", int: "IfcInteger"}
        properties = []
        for label, value in values.items():
            measure, content = value if isinstance(value, tuple) else (plain[type(value)], value)
            properties.append(self._new("IfcPropertySingleValue", label, None, self._new(measure, content), None))
        return self._root("IfcPropertySet", key, name, HasProperties=properties)

    def _quantities(self, entity: Entity, name: str, quantities: Sequence[tuple[str, str, float]]) -> None:
        rows = [self._new(kind, label, None, None, float(value), None) for kind, label, value in quantities]
        key = f"{name} {entity.GlobalId}"
        sets = self._root("IfcElementQuantity", key, name, Quantities=rows)
        fields = {"RelatedObjects": [entity], "RelatingPropertyDefinition": sets}
        self._new("IfcRelDefinesByProperties", self._guid(f"defines {key}"), **fields)

    def _axes(self, pose: Pose, z: float = 0.0) -> Entity:
        x, y, yaw = (float(value) for value in pose)
        point = self._new("IfcCartesianPoint", (x, y, float(z))) if (x, y, z) != (0.0, 0.0, 0.0) else self._zero
        ahead = self._new("IfcDirection", (math.cos(yaw), math.sin(yaw), 0.0)) if yaw else self._ahead
        return self._new("IfcAxis2Placement3D", point, self._up, ahead)

    def _place(self, parent: Entity | None, pose: Pose, z: float = 0.0) -> Entity:
        """Return the placement at a pose in the frame of another entity, meters and radians."""
        return self._new("IfcLocalPlacement", parent.ObjectPlacement if parent else None, self._axes(pose, z))

    def _box(self, box: OrientedBox) -> Entity:
        profile = self._new("IfcRectangleProfileDef", "AREA", None, self._flat, float(box.width), float(box.depth))
        return self._extruded(profile, (box.x, box.y, box.yaw), box.z0, box.z1 - box.z0)

    def _prism(self, polygon: Polygon, z: float, height: float) -> Entity:
        def curve(ring: Any) -> Entity:
            points = [self._new("IfcCartesianPoint", (float(x), float(y))) for x, y, *_ in ring.coords[:-1]]
            return self._new("IfcPolyline", [*points, points[0]])

        outer, inner = curve(polygon.exterior), [curve(ring) for ring in polygon.interiors]
        profile = (
            self._new("IfcArbitraryProfileDefWithVoids", "AREA", None, outer, inner)
            if inner
            else self._new("IfcArbitraryClosedProfileDef", "AREA", None, outer)
        )
        return self._extruded(profile, (0.0, 0.0, 0.0), z, height)

    def _extruded(self, profile: Entity, pose: Pose, z: float, height: float) -> Entity:
        return self._new("IfcExtrudedAreaSolid", profile, self._axes(pose, z), self._up, float(height))

    def _shape(self, representations: Sequence[tuple[str, str, Sequence[Entity]]]) -> Entity:
        shapes = [
            self._new("IfcShapeRepresentation", self._contexts[name], name, kind, list(items))
            for name, kind, items in representations
        ]
        return self._new("IfcProductDefinitionShape", None, None, shapes)

    def _mapped(self, shape: Entity) -> Entity:
        here = self._new("IfcCartesianTransformationOperator3D", None, None, self._zero, None, None)
        item = self._new("IfcMappedItem", shape, here)
        body = self._new("IfcShapeRepresentation", self._contexts["Body"], "Body", "MappedRepresentation", [item])
        return self._new("IfcProductDefinitionShape", None, None, [body])


def _ifc_class(asset: Asset, support: str) -> tuple[str, str]:
    if support in (FLOOR, WALL):
        if asset.subtype in CLASSES:
            return CLASSES[asset.subtype]
        if asset.category in FURNITURE:
            return "IfcFurniture", "USERDEFINED"
    return "IfcBuildingElementProxy", "USERDEFINED"


def _hazards(asset: Asset) -> dict[str, Any]:
    """Return the hazards of an asset, its storage class, and for a reagent its chemistry."""
    values: dict[str, Any] = {
        "".join(part.capitalize() for part in name.split("_")): True
        for name, value in asset.hazards.model_dump().items()
        if value
    }
    if asset.storage_class is not None:
        values["StorageClass"] = str(asset.storage_class)
    chemistry = asset.chemistry
    if chemistry is not None:
        texts = {
            "StorageClass": str(chemistry.storage_class),
            "CAS": chemistry.cas,
            "HazardStatements": ", ".join(chemistry.h_codes),
            "NFPA704": "-".join(map(str, chemistry.nfpa)) if chemistry.nfpa else None,
        }
        values |= {name: text for name, text in texts.items() if text}
    return values


def _services(asset: Asset) -> dict[str, Any]:
    """Return the services that an asset needs, with its demands as texts with units."""
    values: dict[str, Any] = {}
    for service in services_of(asset, []):
        amount = amount_of(asset, service)
        values[service.capitalize()] = "needed" if amount is None else f"{amount:.4g} {UNITS[service]}"
    return values
