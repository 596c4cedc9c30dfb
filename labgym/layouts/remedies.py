"""The smallest changes of an infeasible request that make it feasible, each one verified by furnishing it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import islice

from labgym.errors import InfeasibleError, LabgymError, OptionError
from labgym.layouts.floor import Floor
from labgym.layouts.floor.changes import Stretch, closed_doors, extended, stretched, walls_with
from labgym.layouts.interiors import FloorProposer
from labgym.layouts.interiors.needs import GROUPS, separations_on
from labgym.layouts.request import Request, combination
from labgym.layouts.rules.objective import evaluate_layout

LONGEST = 3.2
"""Greatest length by which a space is made longer, meters."""
STEP = 0.1
"""The least length that helps is determined to this, meters."""
ROOMS = ((4.0, 4.0), (6.0, 5.0), (8.0, 6.0))
"""Sizes of a further laboratory that are tried, smallest first, meters."""
TRIALS = 8
"""Most changes that are tried."""
ENOUGH = 3
"""Number of changes that help with which the search for further ones ends."""
SHOWN = 6
"""Most distances that a message names."""
MOST = 8
"""Most fixed pieces, keep-outs and spaces that are tried one by one."""


@dataclass(frozen=True)
class Remedy:
    """A change that makes a request feasible.

    Attributes:
        text: the change, as an instruction.
        request: the changed request, which has been furnished without violations.
    """

    text: str
    request: Request


def remedies(request: Request, trials: int = TRIALS) -> tuple[Remedy, ...]:
    """Return changes of an infeasible request, each of which alone makes it feasible, the mildest kind first.

    The changes are: open the doors between spaces, drop the requirement of a service, remove a keep-out or a fixed
    piece, leave a protocol out, make a space longer (by the least length, to 0.1 m), and add a laboratory at an exit.
    Each is verified: the request that it gives is furnished and checked. A change whose search ends at the effort limit
    is not returned. The search ends with three changes. Deterministic.

    Args:
        trials: most changes that are tried.
    """
    search = _Search(request, trials)
    return tuple(islice((remedy for kind in KINDS for remedy in kind(search)), ENOUGH))


def clashes(request: Request) -> tuple[str, ...]:
    """Return the groups of constraints without which an infeasible floor has a plan, with their figures."""
    found = []
    for group in GROUPS:
        try:
            FloorProposer(frozenset({group}), "short").plan(request)
        except InfeasibleError:
            continue
        if group == "separations":
            rules = [f"{r.first} {r.distance:.2f} m from {r.second} ({r.reason})" for r in separations_on(request)]
            group += f": {', '.join(rules[:SHOWN])}"
        found.append(f"a plan exists without {group}")
    return tuple(found)


def with_remedies(error: InfeasibleError, request: Request) -> InfeasibleError:
    """Return an error that also names the constraints that clash and the changes that make its request feasible."""
    error = error.with_conflicts((*error.conflicts, *clashes(request)))
    changes = remedies(request)
    if changes:
        words = "this change makes it feasible" if len(changes) == 1 else "any one of these changes makes it feasible"
        text = f"{words}: {'; '.join(remedy.text for remedy in changes)}"
    else:
        text = "no single change of services, keep-outs, fixed pieces, protocols or sizes up to 3.2 m was found to help"
        text += f"; {error.remedy}"
    return error.with_remedy(text)


class _Search:
    """Trials of changed requests, as many as are allowed."""

    def __init__(self, request: Request, trials: int) -> None:
        self.request = request
        self.trials = trials

    def fits(self, request: Request) -> bool:
        """Whether a changed request can be furnished without violations; not any more once the trials are used up."""
        if self.trials <= 0:
            return False
        self.trials -= 1
        try:
            layout = FloorProposer(patience="short").propose(request)
        except (InfeasibleError, OptionError):
            return False
        return evaluate_layout(layout, request.protocol, request.rules.furnishing, navigation=True).cost == 0

    def keep(self, changes: Iterator[tuple[str, Request]]) -> Iterator[Remedy]:
        """Yield the changes that help."""
        return (Remedy(text, request) for text, request in changes if self.fits(request))


def _without_services(search: _Search) -> Iterator[Remedy]:
    request, services = search.request, search.request.floor.services

    def relaxed(kind: str) -> Request:
        changed = (s.model_copy(update={"required": False}) if s.kind == kind else s for s in services)
        return replace(request, floor=_with(request.floor, services=tuple(changed)))

    kinds = sorted({service.kind for service in services if service.required})
    return search.keep((f"drop the requirement of {kind}", relaxed(kind)) for kind in kinds)


def _with_open_doors(search: _Search) -> Iterator[Remedy]:
    """Open all closed doors between spaces, through which the robot cannot pass."""
    request = search.request
    closed = closed_doors(request.floor)
    if not closed:
        return iter(())
    text = f"open the closed doors between spaces ({len(closed)})"
    opened = _with(request.floor, walls=walls_with(request.floor, closed, state="open"))
    return search.keep(iter([(text, replace(request, floor=opened))]))


def _without_keep_outs(search: _Search) -> Iterator[Remedy]:
    request, areas = search.request, search.request.floor.keep_outs

    def relaxed(name: str) -> Request:
        return replace(request, floor=_with(request.floor, keep_outs=tuple(a for a in areas if a.id != name)))

    return search.keep((f"remove the keep-out {area.id!r}", relaxed(area.id)) for area in areas[:MOST])


def _without_fixed(search: _Search) -> Iterator[Remedy]:
    request, fixed = search.request, search.request.fixed
    alone = list(
        search.keep(
            (f"remove the fixed piece {piece.id!r}", replace(request, fixed=tuple(p for p in fixed if p is not piece)))
            for piece in fixed[:MOST]
        )
    )
    yield from alone
    if len(fixed) > 1 and not alone:
        yield from search.keep(iter([("remove all fixed pieces", replace(request, fixed=()))]))


def _without_protocols(search: _Search) -> Iterator[Remedy]:
    request, several = search.request, search.request.several

    def relaxed(name: str) -> Request:
        rest = tuple(protocol for protocol in several if protocol.id != name)
        together = rest if len(rest) > 1 else ()
        return replace(request, protocol=combination(rest, request.catalog), several=together)

    return search.keep((f"leave out protocol {one.id!r}", relaxed(one.id)) for one in several)


def _longer(search: _Search) -> Iterator[Remedy]:
    """Make a space longer along one of its axes, by the least length that helps."""
    request = search.request
    spaces = [space for space in request.floor.spaces if space.use != "corridor"]
    for space in sorted(spaces, key=lambda space: (space.use != "laboratory", -space.area, space.id))[:MOST]:
        for axis in (0, 1):
            least = _least(lambda by, axis=axis, name=space.id: _grown(search, name, axis, by))  # type: ignore[misc]
            if least is not None:
                by, changed = least
                yield Remedy(f"make {_size_text(request.floor, changed.floor, space.id, axis, by)}", changed)


def _grown(search: _Search, space: str, axis: int, by: float) -> Request | None:
    """The request on a longer floor if that helps."""
    stretch = stretched(search.request.floor, space, axis, by)
    if stretch is None:
        return None
    request = _moved(search.request, stretch)
    return request if search.fits(request) else None


def _moved(request: Request, stretch: Stretch) -> Request:
    """A request on a longer floor; fixed pieces beyond the cut move with it."""
    fixed = tuple(
        piece.model_copy(update={"position": (*stretch.moved(*piece.position[:2]), piece.position[2])})
        for piece in request.fixed
    )
    return replace(request, floor=stretch.floor, fixed=fixed)


def _least(attempt: Callable[[float], Request | None]) -> tuple[float, Request] | None:
    """The least length for which an attempt succeeds, by halving, and what it returns; None if the longest fails."""
    low, high, best = 0.0, LONGEST, attempt(LONGEST)
    while best is not None and high - low > STEP + 1e-9:
        middle = round(low + round((high - low) / 2.0 / STEP) * STEP, 6)
        result = attempt(middle)
        if result is None:
            low = middle
        else:
            high, best = middle, result
    return None if best is None else (high, best)


def _size_text(before: Floor, after: Floor, space: str, axis: int, by: float) -> str:
    """The space to be made longer, and its size afterward."""
    region = after.space(space).region
    width = max(r.x1 for r in region) - min(r.x0 for r in region)
    depth = max(r.y1 for r in region) - min(r.y0 for r in region)
    what = "the room" if len(before.spaces) == 1 else repr(space)
    return f"{what} {by:.1f} m {'wider' if axis == 0 else 'deeper'} ({width:g} x {depth:g} m)"


def _with_room(search: _Search) -> Iterator[Remedy]:
    """Add a laboratory at an exit; the smallest one that helps."""
    request = search.request
    for width, depth in ROOMS:
        for number, floor in extended(request.floor, width, depth):
            changed = replace(request, floor=floor)
            if search.fits(changed):
                text = f"add a laboratory of {width:g} x {depth:g} m at the exit of wall {number}"
                yield Remedy(text, changed)
                return


def _with(floor: Floor, **changes: object) -> Floor:
    """A floor with some fields changed, checked."""
    try:
        return Floor(**{**{name: getattr(floor, name) for name in Floor.model_fields}, **changes})
    except ValueError as error:
        raise LabgymError(str(error)) from None


KINDS = (
    _with_open_doors,
    _without_services,
    _without_keep_outs,
    _without_fixed,
    _without_protocols,
    _longer,
    _with_room,
)
"""The kinds of changes, the mildest first."""
