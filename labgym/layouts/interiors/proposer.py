"""The proposer for floors: furniture spread over the spaces, and each space furnished in its own frame."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Literal

import numpy as np

from labgym.errors import InfeasibleError, SearchLimitError
from labgym.geometry import OrientedBox
from labgym.layouts.assembly import Plan
from labgym.layouts.brief import Brief, Content, Proximity, Separation, Unit
from labgym.layouts.briefing import nearness_of, separations_of
from labgym.layouts.cabinets import Cabinet, plan_cabinets
from labgym.layouts.floor_plan import Pose
from labgym.layouts.ground import Ground
from labgym.layouts.habits import Habits, RoomHabit
from labgym.layouts.infeasibility import fixed_conflicts
from labgym.layouts.interiors.distances import handling_distances, neighborhoods, proximities_of
from labgym.layouts.interiors.distribution import distribute, wall_length
from labgym.layouts.interiors.emergency import add_emergency_equipment
from labgym.layouts.interiors.filling import Names, add_piece, add_pieces, fill
from labgym.layouts.interiors.furnisher import ATTEMPTS, Demands, Outcome, furnish
from labgym.layouts.interiors.interior import Interior
from labgym.layouts.interiors.obstruction import obstructions
from labgym.layouts.interiors.setups import assembled
from labgym.layouts.interiors.standing import Distances
from labgym.layouts.interiors.surfaces import stock_surfaces
from labgym.layouts.model import WALL, Layout
from labgym.layouts.pieces import WallPiece, clear_around, front_of, further_pieces, pieces, with_fixed
from labgym.layouts.request import Request
from labgym.layouts.rules.supplies import supplies_of
from labgym.layouts.rules.thresholds import MOVABLE
from labgym.layouts.rules.zones import INTRUSION
from labgym.layouts.style import Style
from labgym.layouts.surroundings import grounds as grounds_of

DISTRIBUTIONS = 4
"""Number of distributions over the spaces that are tried."""
SHORT = 3
"""Number of them in a short search on a floor of several spaces, in which the solver does not choose the walls."""
EXTRA_BENCHES = 6
"""Most benches that are added because the instruments do not fit on the others."""
EXTRA_HOODS = 3
"""Most hoods that are added because the apparatus of several protocols does not fit in the others."""
SECOND_HOOD = "FumeHood1200"
GROUPS = ("separations", "front clearance")
"""Groups of constraints that can be lifted."""
BENCHES = ("LabBench1800", "LabBench", "LabBench1200")
ASSEMBLY_STREAM = 0xA5
"""Sub-stream of the seed for the arrangement of apparatus."""


@dataclass(frozen=True)
class FloorProposer:
    """Laboratory planning habits by the use of each space, a constraint solver, and a seed; offline, deterministic.

    Attributes:
        lifted: groups of constraints that are left out, to find out which of them clash: see `GROUPS`.
        patience: whether to search to the end, or only with the attempts that come first and cost little. What a short
            search finds, a full one finds too.
    """

    lifted: frozenset[str] = frozenset()
    patience: Literal["full", "short"] = "full"

    def propose(self, request: Request) -> Layout:
        """Return a layout without geometric or chemical violations, in which glassware is assembled to apparatus.

        Raises:
            InfeasibleError: the floor cannot hold what the protocols require.
            SearchLimitError: the search ended without a plan and without a proof of infeasibility.
        """
        generator = np.random.default_rng([request.seed, ASSEMBLY_STREAM])
        constraints = (rule for protocol in request.protocols for rule in protocol.spatial_constraints)
        tied = {request.catalog.find(rule.subject).name for rule in constraints if rule.kind == "on"}
        holdings = request.holdings
        stands = None if holdings is None or holdings.purchases == "any" else holdings.counts
        return assembled(self.plan(request).layout(), request.profile, generator, tied, stands)

    def plan(self, request: Request) -> Plan:
        """Return the first plan in which ways lead to everything, filled as the request's style asks for.

        Raises:
            InfeasibleError, SearchLimitError: as `propose`.
        """
        grounds = grounds_of(request.floor)
        _check(request, grounds)
        entropy = int.from_bytes(hashlib.sha256(request.protocol.id.encode()).digest()[:8], "big")
        attempts: Counter[str] = Counter()
        several = len(grounds) > 1
        for attempt in range(DISTRIBUTIONS if self.patience == "full" else SHORT if several else 1):
            generator = np.random.default_rng([request.seed, entropy, attempt])
            last = attempt == DISTRIBUTIONS - 1
            needs = _relaxed(_needs(request, generator, 0 if last else EXTRA_HOODS), self.lifted)
            if attempt == 0 and self.patience == "short":
                _check_places(request, needs, grounds)
            rooms, outcome = _furnished(request, needs, grounds, last, generator)
            attempts += outcome.attempts
            if rooms is not None:
                left = _fill(request, needs, rooms, generator)
                return _plan(request, needs, rooms, left, attempts)
            if attempt == 0 and self.patience == "full":
                _check_places(request, needs, grounds)
        raise _failure(request, needs, grounds, outcome, attempts)


@dataclass(frozen=True)
class _Needs:
    """The furniture that a floor must hold.

    Attributes:
        required: units in the order in which they are placed in the layout. further: pieces for more than that.
        contents: what each required unit holds.
        separations: distances that units must keep. wished, proximities: those that they keep if a plan is found.
    """

    required: tuple[Unit, ...]
    further: tuple[Unit, ...]
    contents: Mapping[str, tuple[Content, ...]]
    separations: tuple[Separation, ...]
    wished: tuple[Separation, ...] = ()
    proximities: tuple[Proximity, ...] = ()


def _needs(request: Request, generator: np.random.Generator, hoods: int = EXTRA_HOODS) -> _Needs:
    """Return the furniture that protocols, safety and habit require, and its contents.

    Args:
        hoods: most hoods that are added because the apparatus does not fit in the others.

    Raises:
        InfeasibleError: something fits on no surface or shelf.
    """
    cabinets = _cabinets(request)
    units = [_unit(request, piece) for piece in pieces(request, cabinets, "required")]
    units = with_fixed(request, units)
    contents = _stocked(request, cabinets, units, hoods if request.holdings is None else 0, generator)
    _check_holdings(request, units, contents)
    further = [_unit(request, piece) for level in ("reduced", "full") for piece in further_pieces(request, level)]
    present = {unit.id for unit in units}
    if request.holdings is not None:
        further = [unit for unit in further if request.holdings.adds(unit.asset.name, (u.asset.name for u in units))]
    handling = handling_distances(request, units, contents)
    return _Needs(
        required=tuple(_supplied(unit, contents.get(unit.id, ())) for unit in units),
        further=tuple(unit for unit in further if unit.id not in present),
        contents=contents,
        separations=(*separations_of(cabinets, contents, request.profile), *handling.least),
        wished=handling.wished,
        proximities=proximities_of(request, units),
    )


def _relaxed(needs: _Needs, lifted: frozenset[str]) -> _Needs:
    """Return the furniture without some groups of constraints."""
    if "separations" in lifted:
        needs = replace(needs, separations=(), wished=(), proximities=())
    if "front clearance" in lifted:
        needs = replace(needs, required=tuple(replace(unit, front=0.0) for unit in needs.required))
    return needs


def separations_on(request: Request) -> tuple[Separation, ...]:
    """Return the distances that the required furniture of a request must keep.

    Raises:
        InfeasibleError: something fits on no surface or shelf.
    """
    return _needs(request, np.random.default_rng(request.seed)).separations


def _cabinets(request: Request) -> tuple[Cabinet, ...]:
    """Return the cabinets with the variants of the floor; fixed ones stay what they are."""
    fixed = {placement.id for placement in request.fixed}
    return tuple(
        cabinet if cabinet.id in fixed else replace(cabinet, asset=request.furniture.instead(cabinet.asset))
        for cabinet in plan_cabinets(request)
    )


def _stocked(
    request: Request, cabinets: Sequence[Cabinet], units: list[Unit], hoods: int, generator: np.random.Generator
) -> dict[str, tuple[Content, ...]]:
    """Return the contents of each unit; add hoods and benches to the units as long as instruments have no place.

    Args:
        hoods: most hoods that are added.

    Raises:
        InfeasibleError: something fits on no surface or shelf.
    """
    benches = 0
    while True:
        surfaces = stock_surfaces(request, cabinets, units, generator)
        if surfaces.unhooded and hoods:
            hoods -= 1
            units.append(_unit(request, _further_hood(request, units)))
            continue
        if not surfaces.homeless:
            return surfaces.contents
        if benches == EXTRA_BENCHES:
            names = ", ".join(surfaces.homeless)
            raise InfeasibleError(request.protocol.id, [f"no work surface has space for {names}"], None)
        benches += 1
        asset = request.catalog.get(_bench(request, units))
        name = Names({unit.id for unit in units}).next(asset)
        units.append(_unit(request, WallPiece(name, asset, "surface for instruments")))


def _further_hood(request: Request, units: Sequence[Unit]) -> WallPiece:
    """Return one more hood: a small one if it is the second, else one like the first."""
    number = sum(unit.asset.fume_hood for unit in units)
    asset = request.catalog.get(SECOND_HOOD if number == 1 else request.habits.default_home)
    return WallPiece(Names({unit.id for unit in units}).next(asset), asset, "hood for further apparatus")


def _bench(request: Request, units: Sequence[Unit]) -> str:
    """Return the bench for more instruments: the first of the usual ones that exists, else the first."""
    existing = {} if request.holdings is None else request.holdings.left(unit.asset.name for unit in units)
    return next((name for name in BENCHES if name in existing), BENCHES[0])


def _check_holdings(request: Request, units: Sequence[Unit], contents: Mapping[str, tuple[Content, ...]]) -> None:
    """Check that everything required exists if nothing may be bought.

    Raises:
        InfeasibleError: names what must be bought.
    """
    if request.holdings is None or request.holdings.purchases != "none":
        return
    things = [unit.asset for unit in units] + [content.asset for each in contents.values() for content in each]
    listed = any(request.catalog.get(name).kind == "reagent" for name in request.holdings.counts)
    missing = request.holdings.missing(thing.name for thing in things if thing.kind != "reagent" or listed)
    if missing:
        names = ", ".join(f"{count} {name}" for name, count in missing.items())
        what = _where(request, "cannot be furnished from what exists for")
        raise InfeasibleError(what, [f"missing: {names}"], None, remedy="buy them, or allow purchases")


def _unit(request: Request, piece: WallPiece) -> Unit:
    asset = request.furniture.instead(piece.asset)
    size, front, clear = asset.size, front_of(request, piece), clear_around(asset)
    unit = Unit(piece.id, asset, size.width, size.depth, front, clear=clear, reason=piece.reason)
    return _supplied(unit, ())


def _supplied(unit: Unit, contents: Sequence[Content]) -> Unit:
    """Return a unit with the services that it and its contents need."""
    return replace(unit, supplies=supplies_of(unit.asset, [content.asset for content in contents]))


def _furnished(
    request: Request, needs: _Needs, grounds: Sequence[Ground], last: bool, generator: np.random.Generator
) -> tuple[dict[str, Interior] | None, Outcome]:
    """The spaces with what is required, None and the outcome of the first that cannot hold its share."""
    fixed = {placement.id: placement for placement in request.fixed}
    free = [unit for unit in needs.required if unit.id not in fixed]
    shares = distribute(free, grounds, request.habits, generator, neighborhoods(needs.proximities))
    nearness = tuple(nearness_of(needs.required, request.habits))
    standing = _standing(request, needs.required, grounds)
    boxes = {unit.id: _to_floor(ground, foot) for ground in grounds for unit, foot in standing[ground.space]}
    rooms: dict[str, Interior] = {}
    total = Outcome(None)
    for ground in sorted(grounds, key=lambda ground: -len(shares[ground.space])):
        here = {unit.id for unit in shares[ground.space]}
        separations = *needs.separations, *needs.wished
        apart, further = (_remote(ground, here, rules, boxes) for rules in (needs.separations, separations))
        outcome = furnish(
            ground,
            shares[ground.space],
            standing[ground.space],
            Demands(separations, nearness, needs.proximities, further),
            Demands(needs.separations, nearness, (), apart),
            _hood_walls(ground, request.style),
            request.seed,
            generator,
            needs.further,
            attempts=ATTEMPTS,
            thorough=last or len(grounds) == 1,
        )
        total.attempts += outcome.attempts
        if outcome.room is None:
            total.proven = outcome.proven and len(grounds) == 1
            total.space = ground.space
            return None, total
        rooms[ground.space] = outcome.room
        boxes |= {unit_id: _to_floor(ground, foot) for unit_id, foot in outcome.room.feet.items()}
    return {ground.space: rooms[ground.space] for ground in grounds}, total


def _standing(
    request: Request, required: Sequence[Unit], grounds: Sequence[Ground]
) -> dict[str, list[tuple[Unit, OrientedBox]]]:
    """The fixed objects of each space, with their footprints in its ground's frame."""
    units = {unit.id: unit for unit in required}
    standing: dict[str, list[tuple[Unit, OrientedBox]]] = {ground.space: [] for ground in grounds}
    for placement in request.fixed:
        asset = request.fixed_asset(placement)
        if placement.support == WALL and asset.size.depth <= INTRUSION:
            continue
        x, y, _ = placement.position
        box = OrientedBox(x, y, asset.size.width, asset.size.depth, placement.yaw)
        space = request.floor.space_at(x, y)
        unit = units.get(placement.id, Unit(placement.id, asset, asset.size.width, asset.size.depth, 0.0))
        for ground in grounds:
            if space is not None and ground.space == space.id:
                standing[ground.space].append((unit, ground.to_ground(box)))
    return standing


def _remote(
    ground: Ground, here: set[str], separations: Sequence[Separation], boxes: Mapping[str, OrientedBox]
) -> dict[str, Distances]:
    """Return the boxes of other spaces from which units of a space keep a distance, in the frame of its ground."""
    apart: dict[str, list[tuple[OrientedBox, float]]] = {}
    for rule in separations:
        for unit, other in ((rule.first, rule.second), (rule.second, rule.first)):
            if unit in here and other in boxes:
                apart.setdefault(unit, []).append((ground.to_ground(boxes[other]), rule.distance))
    return dict(apart)


def _hood_walls(ground: Ground, style: Style | None) -> frozenset[str]:
    walls = {wall for space, wall in (style.hood_walls if style is not None else ()) if space == ground.space}
    return frozenset(segment.id for segment in ground.segments if walls.intersection(segment.walls))


def _fill(request: Request, needs: _Needs, rooms: Mapping[str, Interior], generator: np.random.Generator) -> list[Unit]:
    """Add further pieces and fill all spaces; return the further pieces that found no place."""
    habits, style = request.habits, request.style if request.style is not None else Style()
    partners: dict[str, list[str]] = {}
    for near in nearness_of((*needs.required, *needs.further), habits):
        partners.setdefault(near.first, []).append(near.second)
        partners.setdefault(near.second, []).append(near.first)
    left, kinds = [], {service.kind for service in request.floor.services}
    for unit in sorted(needs.further, key=lambda unit: kinds.isdisjoint(unit.supplies)):
        able = _able(habits, rooms, unit.asset.role)
        able.sort(key=lambda room: not any(other in room.feet for other in partners.get(unit.id, ())))
        if all(add_pieces(room, [unit], partners, generator) for room in able):
            left.append(unit)
    names = Names({unit.id for unit in (*needs.required, *needs.further)})
    if request.holdings is not None:
        _add_existing(request, needs, rooms, style, names, generator)
        if request.holdings.purchases != "any":
            return left
    add_emergency_equipment(request, rooms, names, generator)
    for room in rooms.values():
        habit = habits.rooms.get(room.ground.use, RoomHabit())
        fill(room, request.furniture, habit, habits.peninsula, style, names, generator)
    return left


def _able(habits: Habits, rooms: Mapping[str, Interior], name: str) -> list[Interior]:
    """The spaces in which an asset may stand, those of its uses first."""
    uses = habits.uses.get(name, ("laboratory",))
    able = [room for use in uses for room in rooms.values() if room.ground.use == use]
    return able + [room for room in rooms.values() if room.ground.use not in (*uses, "corridor")]


def _add_existing(
    request: Request,
    needs: _Needs,
    rooms: Mapping[str, Interior],
    style: Style,
    names: Names,
    generator: np.random.Generator,
) -> None:
    """Place the furniture that exists beyond what is required, the largest pieces first, as far as it finds a place."""
    if request.holdings is None:
        return
    placed = [unit.asset.name for room in rooms.values() for unit in room.units.values()]
    placed += [content.asset.name for contents in needs.contents.values() for content in contents]
    left = [(request.catalog.get(name), count) for name, count in request.holdings.left(placed).items()]
    assets = [a for a, count in left if a.placing == "floor" and a.subtype not in MOVABLE for _ in range(count)]
    full: set[str] = set()
    for asset in sorted(assets, key=lambda asset: (-asset.size.width * asset.size.depth, asset.name)):
        able = _able(request.habits, rooms, asset.name)
        free = request.habits.of(asset.name).stance != "wall"
        if asset.name not in full and not any(add_piece(room, asset, free, style, names, generator) for room in able):
            full.add(asset.name)


def _plan(
    request: Request, needs: _Needs, rooms: Mapping[str, Interior], left: Sequence[Unit], attempts: Counter[str]
) -> Plan:
    poses: dict[str, Pose] = {}
    for room in rooms.values():
        for unit_id, foot in room.feet.items():
            poses[unit_id] = Pose(*room.ground.to_floor((foot.x, foot.y, foot.yaw)))
    fixed = {placement.id: placement for placement in request.fixed}
    poses |= {p.id: Pose(p.position[0], p.position[1], p.yaw) for p in request.fixed}
    on_walls = {p.id: request.fixed_asset(p) for p in request.fixed if p.support == WALL}
    units = {unit.id: unit for room in rooms.values() for unit in room.units.values() if unit.id not in on_walls}
    first = [unit.id for unit in (*needs.required, *needs.further) if unit.id in units]
    brief = Brief(
        units=tuple(units[unit_id] for unit_id in dict.fromkeys((*first, *units))),
        contents=needs.contents,
        fixed=fixed,
        wall_assets=on_walls,
        hoods=tuple(unit.id for unit in units.values() if unit.asset.fume_hood),
        furnishing="reduced" if left else "full",
    )
    style = request.style if request.style is not None else Style()
    values = {name: value for name, value in asdict(style).items() if name != "hood_walls"}
    options: dict[str, object] = {"style": {**values, "kinds": list(style.kinds)}}
    if request.furniture.chosen:
        options["variants"] = dict(request.furniture.chosen)
    if attempts:
        options["attempts"] = dict(sorted(attempts.items()))
    return Plan(request, brief, poses, _note(left), options)


def _to_floor(ground: Ground, foot: OrientedBox) -> OrientedBox:
    x, y, yaw = ground.to_floor((foot.x, foot.y, foot.yaw))
    return OrientedBox(x, y, foot.width, foot.depth, yaw)


def _note(left: Sequence[Unit]) -> str:
    return f"no place for {', '.join(unit.id for unit in left)}" if left else ""


def _check(request: Request, grounds: Sequence[Ground]) -> None:
    """Refuse a floor that is unsuitable for any furniture.

    Raises:
        InfeasibleError: no space for laboratory work, none that is high enough for a hood, or fixed objects that break
            a rule.
    """
    conflicts = []
    if all(ground.use == "corridor" for ground in grounds):
        conflicts.append("all spaces are corridors: give one the use 'laboratory'")
    highest = max(ground.ceiling for ground in grounds)
    units = [_unit(request, piece) for piece in pieces(request, plan_cabinets(request), "required")]
    tall = {unit.asset.name: unit.asset.size.height for unit in units if unit.asset.size.height > highest}
    conflicts += [
        f"{name} is {height:.2f} m high, but the ceiling is {highest:.2f} m: raise the ceiling"
        for name, height in sorted(tall.items())
    ]
    conflicts += fixed_conflicts(request)
    for ground in grounds if request.fixed else ():
        room = Interior(ground)
        for unit, foot in _standing(request, (), grounds)[ground.space]:
            if not room.add_anyway(unit, foot):
                way = f"no way {2.0 * room.ways.radius:.2f} m wide between the doors of {ground.space!r}"
                conflicts.append(f"fixed: {unit.id} leaves {way}")
                break
    if conflicts:
        raise InfeasibleError(_where(request, "cannot hold"), conflicts, None, remedy="change the floor")


def _check_places(request: Request, needs: _Needs, grounds: Sequence[Ground]) -> None:
    """Refuse a floor on which some required piece would stand at no wall even if it were the only one.

    Raises:
        InfeasibleError: names the pieces; of floors with oblique walls, along which not all places are tried, no error.
    """
    able = [ground for ground in grounds if ground.use != "corridor"] or list(grounds)
    if not all(segment.straight for ground in able for segment in ground.segments):
        return
    fixed = {placement.id for placement in request.fixed}
    free = [unit for unit in needs.required if unit.id not in fixed]
    obstructed = obstructions(free, able, _standing(request, needs.required, grounds))
    if obstructed:
        raise InfeasibleError(_where(request, "cannot hold"), obstructed, None, remedy="change the floor")


def _failure(
    request: Request, needs: _Needs, grounds: Sequence[Ground], outcome: Outcome, attempts: Counter[str]
) -> InfeasibleError:
    """The error for a floor without a plan: infeasible if that is proved, else a search that ended."""
    needed = sum(unit.width for unit in needs.required)
    offered = sum(wall_length(ground) for ground in grounds if ground.use != "corridor")
    demand = (
        f"{len(needs.required)} pieces are {needed:.1f} m wide together; the walls between doors, without corners, are "
        f"{offered:.1f} m long"
    )
    if outcome.proven:
        return InfeasibleError(_where(request, "cannot hold"), [demand], None, remedy="enlarge the floor")
    words = {
        "infeasible": "had no plan on the walls that they chose",
        "stopped": "reached the solver's effort limit",
        "closed": "cut a door or a place of work off",
    }
    tried = [f"{attempts[word]} attempts {text}" for word, text in words.items() if attempts[word]]
    what = f"no plan was found for {_where(request, 'with')}; a layout may exist"
    remedy = "try another seed or a larger floor"
    where = [f"the furniture of {outcome.space!r} found no places"] if len(grounds) > 1 else []
    return SearchLimitError(what, [*where, *tried, demand], None, remedy=remedy)


def _where(request: Request, verb: str) -> str:
    names = ", ".join(repr(protocol.id) for protocol in request.protocols)
    noun = "protocol" if len(request.protocols) == 1 else "protocols"
    return f"floor {request.floor.name!r} {verb} {noun} {names}"
