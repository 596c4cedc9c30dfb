"""Assembles glassware and devices on work surfaces to apparatus: each piece in its slot of a stand.

`assets/layouts/setups.json` lists the apparatus, the ones with most pieces first: the stand, and what each slot holds.
The pieces remain separate placements, so that a protocol finds what it requires.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np

from labgym.artefacts import artefacts
from labgym.assets import Asset
from labgym.documents import Document, Record
from labgym.geometry import OrientedBox
from labgym.layouts.interiors.surfaces import arm_at
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, Placement, rounded
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.stocking import BENCH_MARGIN
from labgym.layouts.tabletop import SurfaceItem, SurfaceSpot, pack


class Setup(Record):
    """An apparatus.

    Attributes:
        stand: asset name of its stand.
        pieces: the assets that each slot of the stand can hold, preferred ones first.
        least: number of pieces from which on it is assembled; all of them by default.
    """

    stand: str
    pieces: tuple[tuple[str, ...], ...]
    least: int | None = None


class Setups(Document):
    """A file of apparatus."""

    SCHEMA: ClassVar[str] = "labgym.setups/1"

    setups: tuple[Setup, ...]


@dataclass(frozen=True)
class _Apparatus:
    """A stand and the placements in its slots, by slot."""

    stand: Asset
    pieces: dict[int, Placement]


@lru_cache
def published_setups() -> tuple[Setup, ...]:
    """Return the apparatus of the published file.

    Raises:
        DocumentError: the file is missing or invalid.
    """
    return Setups.load(artefacts("assets") / "layouts" / "setups.json").setups


def assembled(
    layout: Layout,
    profile: Profile,
    generator: np.random.Generator,
    tied: Collection[str] = (),
    stands: Mapping[str, int] | None = None,
) -> Layout:
    """Return a layout in which the pieces on each work surface are assembled as far as they make up apparatus.

    Hoods come first, and take missing pieces from benches. The objects on a surface are arranged anew; glassware and
    stands keep `profile.glass` from its edges. Apparatus that find no place are left in pieces. Fixed objects, and what
    carries others, stay where they are.

    Args:
        tied: assets that no hood takes from a bench, because a protocol says on what they stand.
        stands: number of stands that may be placed, by asset name; None for any number.
    """
    supports = [placement for placement in layout.placements if _is_work_surface(layout, placement)]
    for support in sorted(supports, key=lambda support: not layout.asset(support.id).fume_hood):
        others: list[Placement] = []
        if layout.asset(support.id).fume_hood:
            benches = [bench for bench in supports if layout.asset(bench.id).subtype == "workbench"]
            others = [child for bench in benches for child in _movable(layout, bench) if child.asset not in tied]
        layout = _on_surface(layout, support, others, profile, generator, stands)
    return layout


def _is_work_surface(layout: Layout, placement: Placement) -> bool:
    asset = layout.asset(placement.id)
    open_or_ventilated = asset.subtype in ("workbench", "glovebox") or asset.fume_hood
    return placement.support == FLOOR and bool(asset.surfaces) and open_or_ventilated


def _movable(layout: Layout, support: Placement) -> list[Placement]:
    """Return the items on a support that are not fixed and carry no other item."""
    standing = [child for child in layout.children(support.id) if child.slot == 0]
    return [child for child in standing if not child.fixed and not layout.children(child.id)]


def _on_surface(
    layout: Layout,
    support: Placement,
    others: Sequence[Placement],
    profile: Profile,
    generator: np.random.Generator,
    stands: Mapping[str, int] | None,
) -> Layout:
    standing = [child for child in layout.children(support.id) if child.slot == 0]
    movable = _movable(layout, support)
    chosen = _choose(layout, movable, others, stands)
    while chosen:
        held = {piece.id for apparatus in chosen for piece in apparatus.pieces.values()}
        loose = [child for child in movable if child.id not in held]
        stay = [child for child in standing if child not in movable]
        spots = _arrange(layout, support, chosen, loose, stay, profile, generator)
        if spots is not None:
            return _placed(layout, support, chosen, loose, spots)
        chosen.pop()
    return layout


def _choose(
    layout: Layout, pieces: Sequence[Placement], others: Sequence[Placement], stands: Mapping[str, int] | None
) -> list[_Apparatus]:
    """Return the apparatus that can be made up of pieces and, where those are too few, of others.

    Each piece is in one apparatus, and each apparatus has one of the first pieces.
    """
    free = [*pieces, *others]
    chosen: list[_Apparatus] = []
    for setup in published_setups():
        placed = sum(placement.asset == setup.stand for placement in layout.placements)
        while stands is None or placed + _count(chosen, setup.stand) < stands.get(setup.stand, 0):
            own: dict[int, Placement] = {}
            for slot, names in enumerate(setup.pieces):
                left = [piece for piece in free if piece not in own.values()]
                fitting = [piece for name in names for piece in left if piece.asset == name]
                if fitting:
                    own[slot] = fitting[0]
            native = any(piece in pieces for piece in own.values())
            if not native or len(own) < (setup.least or len(setup.pieces)):
                break
            chosen.append(_Apparatus(layout.catalog.get(setup.stand), own))
            free = [piece for piece in free if piece not in own.values()]
    return chosen


def _count(chosen: Sequence[_Apparatus], stand: str) -> int:
    return sum(apparatus.stand.name == stand for apparatus in chosen)


def _arrange(
    layout: Layout,
    support: Placement,
    chosen: Sequence[_Apparatus],
    loose: Sequence[Placement],
    stay: Sequence[Placement],
    profile: Profile,
    generator: np.random.Generator,
) -> list[SurfaceSpot] | None:
    """Return the spots of the stands and then of the loose objects, or None if one finds no place."""
    surface, headroom = layout.surface(support.id, 0), layout.asset(support.id).surfaces[0].headroom
    items = [_stand_item(layout, apparatus, profile) for apparatus in chosen]
    for child in loose:
        asset = layout.asset(child.id)
        margin = profile.glass if asset.hazards.glass_container else BENCH_MARGIN
        items.append(SurfaceItem.of(asset, margin))
    taken = []
    for child in stay:
        box = layout.box(child.id)
        x, y = surface.to_local(box.x, box.y)
        x0, y0, x1, y1 = OrientedBox(x, y, box.width, box.depth, box.yaw - surface.yaw).bounds()
        taken.append(SurfaceSpot((x0 + x1) / 2.0, (y0 + y1) / 2.0, 0.0, x1 - x0, y1 - y0))
    spots = pack(items, surface.width, surface.depth, headroom, generator, taken, arm_at(layout.asset(support.id)))
    if len(spots) < len(items):
        return None
    margins = [min(spots[k].inset(surface), item.margin) - item.margin for k, item in enumerate(items)]
    return [spots[k] for k in range(len(items))] if min(margins) > -1e-9 else None


def _stand_item(layout: Layout, apparatus: _Apparatus, profile: Profile) -> SurfaceItem:
    stand = apparatus.stand
    tops = [stand.surfaces[k].z + layout.asset(piece.id).size.height for k, piece in apparatus.pieces.items()]
    tops += [fitting.z1 for fitting in stand.fittings]
    return SurfaceItem(stand.name, stand.size.width, stand.size.depth, max(tops), profile.glass)


def _placed(
    layout: Layout,
    support: Placement,
    chosen: Sequence[_Apparatus],
    loose: Sequence[Placement],
    spots: Sequence[SurfaceSpot],
) -> Layout:
    """Return the layout with stands, their pieces and the loose objects at their spots."""
    surface = layout.surface(support.id, 0)
    changed: dict[str, Placement] = {}
    added: list[Placement] = []
    for apparatus, spot in zip(chosen, spots, strict=False):
        name = apparatus.stand.name
        number = 1 + sum(placement.asset == name for placement in (*layout.placements, *added))
        x, y = surface.to_world(spot.x, spot.y)
        yaw = surface.yaw + spot.yaw
        stand = Placement(
            id=f"{name}_{number}",
            asset=name,
            position=rounded(x, y, surface.z0),
            yaw=yaw,
            support=support.id,
            slot=0,
        )
        added.append(stand)
        frame = OrientedBox(x, y, apparatus.stand.size.width, apparatus.stand.size.depth, yaw)
        for slot, piece in apparatus.pieces.items():
            place = apparatus.stand.surfaces[slot]
            position = rounded(*frame.to_world(place.x, place.y), surface.z0 + place.z)
            changed[piece.id] = piece.model_copy(
                update={"position": position, "yaw": yaw, "support": stand.id, "slot": slot}
            )
    for piece, spot in zip(loose, spots[len(chosen) :], strict=True):
        position = rounded(*surface.to_world(spot.x, spot.y), surface.z0)
        changed[piece.id] = piece.model_copy(update={"position": position, "yaw": surface.yaw + spot.yaw})
    kept = tuple(changed.get(placement.id, placement) for placement in layout.placements)
    return layout.replace(placements=(*kept, *added))
