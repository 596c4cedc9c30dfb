"""The constraint program of a brief: variables, constraints and preferences."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Brief, Unit, Wall
from labgym.layouts.constraint_solver import CM, centimeters
from labgym.layouts.floor import Door, Room
from labgym.layouts.floor_plan.rectangles import Edge, Ranges, Rect, fronted, rect_around, union
from labgym.layouts.placement import Placement
from labgym.layouts.rules.zones import HEADROOM, INTRUSION, door_span, front_zone

if TYPE_CHECKING:
    from ortools.sat.python import cp_model

WALL_GAP = 1
"""Gap between a unit and its wall, centimeters."""
SIDE_GAP = 2
"""Gap between neighbors, centimeters."""
GROUPS = ("hood clearance", "front clearance", "aisles", "doors", "separations", "emergency shower")
"""Groups of constraints that can be lifted to find out which of them clash."""
RANK_COST = 150
"""Cost of each step down a unit's list of walls, centimeters of doubled distance: as much as 0.75 m off its anchor."""


@dataclass(frozen=True)
class Piece:
    """A unit that the program places."""

    unit: Unit
    foot: Rect
    zone: Rect
    walls: dict[Wall, Any]
    turned: Any


@dataclass(frozen=True)
class Obstacle:
    """A fixed object: bounds, clear zone in front, height of the bottom in meters, and whether it obstructs zones."""

    id: str
    foot: Rect
    zone: Rect | None
    bottom: float
    obstructs: bool = True


class Program:
    """The constraint program of a brief."""

    def __init__(self, brief: Brief, room: Room, lifted: frozenset[str]) -> None:
        from ortools.sat.python import cp_model

        self.model: cp_model.CpModel = cp_model.CpModel()
        self.brief = brief
        self.width, self.depth = int(room.width * CM), int(room.depth * CM)
        self.terms: list[Any] = []
        free = [unit for unit in brief.units if unit.id not in brief.fixed]
        self.pieces = [self._wall_piece(u) if u.stance == "wall" else self._island_piece(u) for u in free]
        self.obstacles = [_obstacle(brief, placement) for placement in brief.fixed.values()]
        self._no_overlap()
        for group, hoods in (("hood clearance", True), ("front clearance", False)):
            if group not in lifted:
                self._zones_free(hoods)
        if "emergency shower" not in lifted:
            self._surroundings()
        if "aisles" not in lifted:
            self._aisles()
        if "doors" not in lifted:
            self._doors(room)
        if "separations" not in lifted:
            self._separations()
        self._preferences()
        self.model.minimize(sum(self.terms))

    def _corner(self, name: str) -> tuple[Any, Any]:
        x0 = self.model.new_int_var(WALL_GAP, self.width - WALL_GAP, f"{name}.x0")
        y0 = self.model.new_int_var(WALL_GAP, self.depth - WALL_GAP, f"{name}.y0")
        return x0, y0

    def _wall_piece(self, unit: Unit) -> Piece:
        model, long, short, front = (
            self.model,
            centimeters(unit.width),
            centimeters(unit.depth),
            centimeters(unit.front),
        )
        x0, y0 = self._corner(unit.id)
        walls: dict[Wall, Any] = {wall: model.new_bool_var(f"{unit.id}.{wall}") for wall in unit.walls}
        model.add_exactly_one(walls.values())
        across = model.new_bool_var(f"{unit.id}.across")
        model.add(across == sum(walls[wall] for wall in walls if wall in ("left", "right")))
        x1 = x0 + long + (short - long) * across
        y1 = y0 + short + (long - short) * across
        for wall, chosen in walls.items():
            edge = {"left": x0 == WALL_GAP, "right": x1 == self.width - WALL_GAP}
            edge |= {"front": y0 == WALL_GAP, "back": y1 == self.depth - WALL_GAP}
            model.add(edge[wall]).only_enforce_if(chosen)
        reach = union([self._strip(wall, long, short) for wall in unit.walls])
        foot = self._rect((x0, y0, x1, y1), reach)
        zone = (
            x0 - front * walls.get("right", 0),
            y0 - front * walls.get("back", 0),
            x1 + front * walls.get("left", 0),
            y1 + front * walls.get("front", 0),
        )
        zones = union([fronted(self._strip(wall, long, short), wall, front) for wall in unit.walls])
        return Piece(unit, foot, Rect(*(Edge(v, *r) for v, r in zip(zone, zones, strict=True))), walls, across)

    def _strip(self, wall: Wall, long: int, short: int) -> Ranges:
        """Ranges of x0, y0, x1, y1 of a footprint that stands against a wall."""
        right, back = self.width - WALL_GAP, self.depth - WALL_GAP
        slide_x, slide_y = (WALL_GAP, right - long), (WALL_GAP, back - long)
        return {
            "front": (slide_x, (WALL_GAP,) * 2, (WALL_GAP + long, right), (WALL_GAP + short,) * 2),
            "back": (slide_x, (back - short,) * 2, (WALL_GAP + long, right), (back,) * 2),
            "left": ((WALL_GAP,) * 2, slide_y, (WALL_GAP + short,) * 2, (WALL_GAP + long, back)),
            "right": ((right - short,) * 2, slide_y, (right,) * 2, (WALL_GAP + long, back)),
        }[wall]

    def _island_piece(self, unit: Unit) -> Piece:
        model, long, short = self.model, centimeters(unit.width), centimeters(unit.depth)
        x0, y0 = self._corner(unit.id)
        turned = model.new_bool_var(f"{unit.id}.turned")
        x1 = x0 + long + (short - long) * turned
        y1 = y0 + short + (long - short) * turned
        walls: dict[Wall, Any] = {}
        if unit.stance == "peninsula":
            walls = {wall: model.new_bool_var(f"{unit.id}.{wall}") for wall in unit.walls if wall in ("left", "right")}
            model.add_exactly_one(walls.values())
            model.add(turned == 0)
            if "left" in walls:
                model.add(x0 == WALL_GAP).only_enforce_if(walls["left"])
            if "right" in walls:
                model.add(x1 == self.width - WALL_GAP).only_enforce_if(walls["right"])
        right, back, least = self.width - WALL_GAP, self.depth - WALL_GAP, min(long, short)
        low, high = (WALL_GAP, WALL_GAP + least), (right - least, back - least)
        foot = self._rect((x0, y0, x1, y1), ((low[0], high[0]), (low[0], high[1]), (low[1], right), (low[1], back)))
        return Piece(unit, foot, foot, walls, turned)

    def _rect(self, values: tuple[Any, Any, Any, Any], ranges: Ranges) -> Rect:
        self.model.add(values[2] <= self.width - WALL_GAP)
        self.model.add(values[3] <= self.depth - WALL_GAP)
        return Rect(*(Edge(value, *span) for value, span in zip(values, ranges, strict=True)))

    def _no_overlap(self) -> None:
        xs, ys = [], []
        for piece in self.pieces:
            foot, name = piece.foot, piece.unit.id
            long, short = centimeters(piece.unit.width) + SIDE_GAP, centimeters(piece.unit.depth) + SIDE_GAP
            end_x = self.model.new_int_var(0, self.width + SIDE_GAP, f"{name}.x1")
            end_y = self.model.new_int_var(0, self.depth + SIDE_GAP, f"{name}.y1")
            xs.append(
                self.model.new_interval_var(foot.x0.value, long + (short - long) * piece.turned, end_x, f"{name}.x")
            )
            ys.append(
                self.model.new_interval_var(foot.y0.value, short + (long - short) * piece.turned, end_y, f"{name}.y")
            )
        self.model.add_no_overlap_2d(xs, ys)
        for obstacle in self.obstacles:
            for piece in self._below(obstacle):
                self._apart(piece.foot, obstacle.foot, SIDE_GAP)

    def _below(self, obstacle: Obstacle) -> list[Piece]:
        """The units that are high enough to meet an obstacle."""
        return [piece for piece in self.pieces if piece.unit.asset.size.height > obstacle.bottom]

    def _zones_free(self, hoods: bool) -> None:
        """Keep the zone in front of hoods, or of all other units, clear of footprints."""
        for owner in self.pieces:
            if owner.unit.stance != "wall" or owner.unit.front <= 0.0 or owner.unit.asset.fume_hood != hoods:
                continue
            for other in self.pieces:
                if owner is not other:
                    self._apart(owner.zone, other.foot, 0)
            for obstacle in self.obstacles:
                if obstacle.obstructs and obstacle.bottom < HEADROOM:
                    self._apart(owner.zone, obstacle.foot, 0)
        if not hoods:
            for zone in (obstacle.zone for obstacle in self.obstacles):
                if zone is not None:
                    for piece in self.pieces:
                        self._apart(piece.foot, zone, 0)

    def _surroundings(self) -> None:
        """Keep the clear distance around units that have one."""
        feet = self._feet()
        for owner in self.pieces:
            if owner.unit.clear > 0.0:
                for other, foot in feet.items():
                    if other != owner.unit.id:
                        self._apart(owner.foot, foot, centimeters(owner.unit.clear))

    def _aisles(self) -> None:
        for island in self.pieces:
            for other in self.pieces:
                if island.unit.stance == "wall" or island is other:
                    continue
                wide = max(self.brief.aisle, other.unit.front if other.unit.stance == "wall" else 0.0)
                self._apart(island.foot, other.foot, centimeters(wide))
            if island.unit.stance != "wall":
                self._clear_of_walls(island)
                for obstacle in self.obstacles:
                    if obstacle.bottom < HEADROOM:
                        self._apart(island.foot, obstacle.foot, centimeters(self.brief.aisle))

    def _clear_of_walls(self, island: Piece) -> None:
        aisle, foot, walls = centimeters(self.brief.aisle), island.foot, island.walls
        self.model.add(foot.y0.value >= aisle)
        self.model.add(foot.y1.value <= self.depth - aisle)
        self.model.add(foot.x0.value >= aisle - aisle * walls.get("left", 0))
        self.model.add(foot.x1.value <= self.width - aisle + aisle * walls.get("right", 0))

    def _doors(self, room: Room) -> None:
        for door in room.doors:
            swing = self._door_rect(door, self.brief.door_zone)
            for piece in self.pieces:
                self._apart(piece.foot, swing, 0)
            opening = self._door_rect(door, 0.0)
            for piece in self.pieces:
                if piece.unit.id in self.brief.hoods:
                    self._apart(piece.foot, opening, centimeters(self.brief.hood_door))

    def _door_rect(self, door: Door, deep: float) -> Rect:
        half, depth = centimeters((door_span(door) if deep else door.width) / 2.0), centimeters(deep)
        low, high = int(door.offset * CM) - half, int(door.offset * CM) + half
        bounds: dict[str, tuple[int, int, int, int]] = {
            "front": (low, 0, high, depth),
            "back": (low, self.depth - depth, high, self.depth),
            "left": (0, low, depth, high),
            "right": (self.width - depth, low, self.width, high),
        }
        return Rect.fixed(*bounds[door.wall])

    def _separations(self) -> None:
        feet = self._feet()
        for rule in self.brief.separations:
            if not {rule.first, rule.second} <= set(self.brief.fixed):
                self._apart(feet[rule.first], feet[rule.second], centimeters(rule.distance))

    def _feet(self) -> dict[str, Rect]:
        feet = {obstacle.id: obstacle.foot for obstacle in self.obstacles}
        return feet | {piece.unit.id: piece.foot for piece in self.pieces}

    def _apart(self, first: Rect, second: Rect, gap: int) -> None:
        """Two rectangles lie at least a gap apart along x or along y."""
        sides = ((first.x1, second.x0), (second.x1, first.x0), (first.y1, second.y0), (second.y1, first.y0))
        if any(before.high + gap <= after.low for before, after in sides):
            return
        chosen = []
        for before, after in sides:
            if before.low + gap <= after.high:
                side = self.model.new_bool_var("")
                self.model.add(before.value + gap <= after.value).only_enforce_if(side)
                chosen.append(side)
        self.model.add_bool_or(chosen)

    def _preferences(self) -> None:
        feet = self._feet()
        for piece in self.pieces:
            for rank, wall in enumerate(piece.unit.walls):
                if wall in piece.walls:
                    self.terms.append(RANK_COST * rank * piece.walls[wall])
            self._anchor(piece)
        for pair in self.brief.nearness:
            if {pair.first, pair.second} <= set(self.brief.fixed):
                continue
            first, second = feet[pair.first], feet[pair.second]
            for low, high in ((0, 2), (1, 3)):
                doubled = first[low].value + first[high].value - second[low].value - second[high].value
                self.terms.append(pair.weight * self._absolute(doubled))

    def _anchor(self, piece: Piece) -> None:
        foot, anchors = piece.foot, piece.unit.anchors
        doubled_x, doubled_y = foot.x0.value + foot.x1.value, foot.y0.value + foot.y1.value
        if piece.unit.stance == "island":
            anchor_x, anchor_y = anchors.get("island_x", 0.5), int(2 * anchors["island"] * self.depth)
            self.terms += [
                self._absolute(doubled_x - int(2 * anchor_x * self.width)),
                self._absolute(doubled_y - anchor_y),
            ]
            return
        for wall, chosen in piece.walls.items():
            if wall not in anchors:
                continue
            length = self.width if wall in ("front", "back") else self.depth
            along = (doubled_x if wall in ("front", "back") else doubled_y) - int(2 * anchors[wall] * length)
            distance = self.model.new_int_var(0, 4 * max(self.width, self.depth), "")
            self.model.add(distance >= along).only_enforce_if(chosen)
            self.model.add(distance >= -along).only_enforce_if(chosen)
            self.terms.append(distance)

    def _absolute(self, expression: Any) -> Any:
        value = self.model.new_int_var(0, 4 * max(self.width, self.depth), "")
        self.model.add(value >= expression)
        self.model.add(value >= -expression)
        return value


def _obstacle(brief: Brief, placement: Placement) -> Obstacle:
    unit = next((unit for unit in brief.units if unit.id == placement.id), None)
    x, y, z = placement.position
    if unit is None:
        size = brief.wall_assets[placement.id].size
        box = OrientedBox(x, y, size.width, size.depth, placement.yaw)
        return Obstacle(placement.id, rect_around(box), None, z, size.depth > INTRUSION)
    box = OrientedBox(x, y, unit.width, unit.depth, placement.yaw)
    zone = rect_around(front_zone(box, unit.front)) if unit.front > 0.0 else None
    return Obstacle(placement.id, rect_around(box), zone, z)
