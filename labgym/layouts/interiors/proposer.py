"""The proposer for floors: furniture spread over the spaces, and each space furnished in its own frame."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

import numpy as np

from labgym.assets import Asset, Catalog
from labgym.errors import InfeasibleError
from labgym.geometry import OrientedBox
from labgym.layouts.brief import Brief, Demands, Unit
from labgym.layouts.equipping import equipped
from labgym.layouts.ground import Ground
from labgym.layouts.ground import grounds as grounds_of
from labgym.layouts.interiors.completion import complete
from labgym.layouts.interiors.distances import dry_separations, nearness_of, neighborhoods
from labgym.layouts.interiors.distribution import distribute
from labgym.layouts.interiors.filling import Names
from labgym.layouts.interiors.furnisher import FurnishedSpace, Share, furnish
from labgym.layouts.interiors.interior import Interior, fixed_pieces
from labgym.layouts.interiors.needs import EXTRA_HOODS, Needs, needs_of, relaxed
from labgym.layouts.interiors.refusals import check_floor, check_places, check_walls, failure, usable
from labgym.layouts.interiors.safeguards import with_safeguards
from labgym.layouts.interiors.setups import assembled
from labgym.layouts.interiors.siting import distances_from
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL, Placement, rounded
from labgym.layouts.records import Provenance
from labgym.layouts.request import Request
from labgym.layouts.rooms import room_presets
from labgym.layouts.style import Style


@dataclass(frozen=True)
class Pose:
    """Center of a footprint in the floor's frame, meters, and yaw, radians."""

    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class PosedBrief:
    """A furnished brief and a pose for each of its units, from which a layout is assembled.

    Attributes:
        note: why the room is not fully furnished; empty if it is.
        options: further facts for the layout's provenance.
    """

    request: Request
    brief: Brief
    poses: Mapping[str, Pose]
    note: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)

    def layout(self) -> Layout:
        """Return the layout: furniture at its poses with its contents."""
        return _with_contents(self)[0]

    def reasons(self) -> dict[str, str]:
        """Return why each placement is there, by placement id."""
        return _with_contents(self)[1]


def _with_contents(plan: PosedBrief) -> tuple[Layout, dict[str, str]]:
    """The layout of a plan, and the reason of each placement by id."""
    placements: list[Placement] = []
    reasons: dict[str, str] = {}
    counts: dict[str, int] = {}
    fixed = plan.brief.fixed
    for unit in plan.brief.units:
        pose = plan.poses[unit.id]
        position = rounded(pose.x, pose.y, 0.0)
        placement = Placement(id=unit.id, asset=unit.asset.name, position=position, yaw=pose.yaw, support=FLOOR)
        placements.append(_in_role(fixed.get(unit.id, placement), unit.asset, plan.request.catalog))
        reasons[unit.id] = unit.reason
    for placement_id in plan.brief.wall_assets:
        placements.append(fixed[placement_id])
        reasons[placement_id] = "fixed by the request"
    for unit in plan.brief.units:
        pose = plan.poses[unit.id]
        frame = OrientedBox(pose.x, pose.y, unit.width, unit.depth, pose.yaw)
        for content in plan.brief.contents.get(unit.id, ()):
            surface, name = unit.asset.surfaces[content.slot], content.asset.name
            x, y = frame.to_world(surface.x + content.spot.x, surface.y + content.spot.y)
            counts[name] = counts.get(name, 0) + 1
            while f"{name}_{counts[name]}" in fixed:
                counts[name] += 1
            placement = Placement(
                id=f"{name}_{counts[name]}",
                asset=name,
                position=rounded(x, y, surface.z),
                yaw=pose.yaw + content.spot.yaw,
                support=unit.id,
                slot=content.slot,
            )
            placements.append(_in_role(placement, content.asset, plan.request.catalog))
            reasons[placements[-1].id] = content.reason
    request, level = plan.request, plan.brief.furnishing
    layout = Layout(
        id=f"{request.protocol.id}-{request.floor.label}-{request.seed}"[:80],
        protocols=request.protocols,
        floor=request.floor,
        placements=tuple(placements),
        catalog=request.catalog,
        provenance=Provenance(
            generator="procedural",
            seed=request.seed,
            options={**plan.options, "furnishing": level, **({} if level == "full" else {"note": plan.note})},
        ),
    )
    return layout, reasons


def _in_role(placement: Placement, asset: Asset, catalog: Catalog) -> Placement:
    """A placement that names the role of its asset, if that is not the asset's own."""
    own = catalog.get(placement.asset).role
    return placement if asset.role == own else placement.model_copy(update={"role": asset.role})


DISTRIBUTIONS = 4
"""Number of distributions over the spaces that are tried."""
SHORT = 3
"""Number of them in a short search on a floor of several spaces, in which the solver does not choose the walls."""
RETREATS = 3
"""Most spaces that are left empty one after another because their shares found no places."""
EMPTY = "empty"
"""Provenance option: ids of the spaces that stay empty because they are too small or no wide way leads to them."""
ASSEMBLY_STREAM = 0xA5
"""Sub-stream of the seed for the arrangement of apparatus."""


@dataclass(frozen=True)
class FloorProposer:
    """Laboratory planning habits by the use of each space, a constraint solver, and a seed; offline, deterministic.

    Attributes:
        lifted: groups of constraints that are left out, to find out which of them clash: see
            `labgym.layouts.interiors.needs.GROUPS`.
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
        layout = assembled(self.plan(request).layout(), request.profile, generator, tied, stands)
        return equipped(layout, request)

    def plan(self, request: Request) -> PosedBrief:
        """Return the first plan in which ways lead to everything, filled as the request's style asks for.

        Raises:
            InfeasibleError, SearchLimitError: as `propose`; of a single space they name the smallest preset that fits,
                if the search is full.
        """
        try:
            return self._plan(request)
        except InfeasibleError as error:
            if self.patience == "short" or len(request.floor.spaces) > 1:
                raise
            raise error.with_preset(_smallest_preset(request)) from None

    def _plan(self, request: Request) -> PosedBrief:
        grounds: Sequence[Ground] = grounds_of(request.floor)
        check_floor(request, grounds)
        grounds = usable(request, grounds)
        # Another floor is drawn in place of one of a family.
        retreats = 0 if request.family or self.patience == "short" else RETREATS
        refused: InfeasibleError | None = None
        for _ in range(1 + retreats):
            try:
                plan, space = self._spread(request, grounds)
            except InfeasibleError as error:
                refused = refused or error
                break
            if not isinstance(plan, InfeasibleError):
                return plan
            refused = refused or plan
            grounds = [ground for ground in grounds if ground.space != space]
            if all(ground.use == "corridor" for ground in grounds):
                break
        assert refused is not None
        raise refused

    def _spread(self, request: Request, grounds: Sequence[Ground]) -> tuple[PosedBrief | InfeasibleError, str]:
        """Return the first plan that furnishes some spaces, or the error and the space whose share found no places.

        Raises:
            InfeasibleError: the spaces cannot hold what the protocols require.
        """
        check_walls(request, needs_of(request, np.random.default_rng(request.seed), 0).required, grounds)
        entropy = int.from_bytes(hashlib.sha256(request.protocol.id.encode()).digest()[:8], "big")
        attempts: Counter[str] = Counter()
        several = len(grounds) > 1
        for attempt in range(DISTRIBUTIONS if self.patience == "full" else SHORT if several else 1):
            generator = np.random.default_rng([request.seed, entropy, attempt])
            last = attempt == DISTRIBUTIONS - 1
            needs = relaxed(needs_of(request, generator, 0 if last else EXTRA_HOODS), self.lifted)
            if attempt == 0 and self.patience == "short":
                check_places(request, needs.required, grounds)
            rooms, outcome = furnish_spaces(request, needs, grounds, last, generator)
            attempts += outcome.attempts
            if rooms is not None:
                left = complete(request, needs, rooms, generator)
                empty = [space.id for space in request.floor.spaces if space.id not in rooms]
                return _assembled(request, needs, rooms, left, attempts, empty), ""
            if attempt == 0 and self.patience == "full":
                check_places(request, needs.required, grounds)
        return failure(request, needs.required, grounds, outcome, attempts), outcome.space


def _smallest_preset(request: Request) -> str | None:
    """Return the name of the smallest room preset for which a short search finds a plan, or None."""
    for name, room in room_presets().items():
        try:
            FloorProposer(patience="short").plan(replace(request, floor=room.floor, fixed=()))
        except InfeasibleError:
            continue
        return name
    return None


def _assembled(
    request: Request,
    needs: Needs,
    rooms: Mapping[str, Interior],
    left: Sequence[Unit],
    attempts: Counter[str],
    empty: Sequence[str],
) -> PosedBrief:
    """Return the plan of furnished spaces; `left` are the further pieces that found no place, `empty` other spaces."""
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
        furnishing="reduced" if left else "full",
    )
    style = request.style
    values = {name: value for name, value in asdict(style).items() if name != "hood_walls"}
    options: dict[str, object] = {"style": {**values, "kinds": list(style.kinds)}}
    if request.furniture.chosen:
        options["variants"] = dict(request.furniture.chosen)
    if attempts:
        options["attempts"] = dict(sorted(attempts.items()))
    if empty:
        options[EMPTY] = list(empty)
    return PosedBrief(request, brief, poses, _note(left), options)


def _note(left: Sequence[Unit]) -> str:
    return f"no place for {', '.join(unit.id for unit in left)}" if left else ""


def furnish_spaces(
    request: Request, needs: Needs, grounds: Sequence[Ground], last: bool, generator: np.random.Generator
) -> tuple[dict[str, Interior] | None, FurnishedSpace]:
    """Return the spaces with the required furniture; None and the outcome of the first that cannot hold its share."""
    fixed = {placement.id: placement for placement in request.fixed}
    free = [unit for unit in needs.required if unit.id not in fixed]
    shares = distribute(free, grounds, request.habits, generator, neighborhoods(needs.proximities))
    nearness = tuple(nearness_of(needs.required, request.habits))
    standing = fixed_pieces(request, needs.required, grounds)
    names = Names({unit.id for unit in (*needs.required, *needs.further)})
    shares = with_safeguards(request, grounds, shares, standing, names)
    units = [unit for share in shares.values() for unit in share]
    dry = [rule for rule in dry_separations(units) if rule not in needs.separations] if needs.separations else []
    least = (*needs.separations, *dry)
    boxes = {unit.id: ground.box_on_floor(foot) for ground in grounds for unit, foot in standing[ground.space]}
    rooms: dict[str, Interior] = {}
    total = FurnishedSpace(None)
    for ground in sorted(grounds, key=lambda ground: -len(shares[ground.space])):
        here = {unit.id for unit in shares[ground.space]}
        separations = *least, *needs.wished
        elsewhere = {name: ground.to_ground(box) for name, box in boxes.items()}
        apart, further = (distances_from(elsewhere, here, rules) for rules in (least, separations))
        share = Share(
            ground,
            units=shares[ground.space],
            standing=standing[ground.space],
            wished=Demands(separations, nearness, needs.proximities, further),
            least=Demands(least, nearness, (), apart),
            hood_walls=_hood_walls(ground, request.style),
            further=needs.further,
        )
        outcome = furnish(share, request.seed, generator, thorough=last or len(grounds) == 1)
        total.attempts += outcome.attempts
        if outcome.room is None:
            total.proven = outcome.proven and len(grounds) == 1
            total.space = ground.space
            return None, total
        rooms[ground.space] = outcome.room
        boxes |= {unit_id: ground.box_on_floor(foot) for unit_id, foot in outcome.room.feet.items()}
    return {ground.space: rooms[ground.space] for ground in grounds}, total


def _hood_walls(ground: Ground, style: Style) -> frozenset[str]:
    walls = {wall for space, wall in style.hood_walls if space == ground.space}
    return frozenset(segment.id for segment in ground.segments if walls.intersection(segment.walls))
