"""Control proposers: no proposal, and a heap. A table in which they do as well as the others shows nothing of those."""

from __future__ import annotations

from dataclasses import dataclass

from labgym.layouts.model import Layout
from labgym.layouts.request import Request
from labgym.paper.rivals.chamber import chambers
from labgym.paper.rivals.piece import RivalPiece, layout_of, named
from labgym.paper.rivals.protocol_plan import required_pieces
from labgym.paper.rivals.randomness import numbers_in_use


@dataclass(frozen=True)
class NothingProposer:
    """Proposes nothing: the room with its fixed objects."""

    def propose(self, request: Request) -> Layout:
        """Return the empty room."""
        return layout_of(request, (), "nothing", {})


@dataclass(frozen=True)
class HeapProposer:
    """Proposes all that the protocol requires in a heap at the center of the room, items in a heap on their piece."""

    def propose(self, request: Request) -> Layout:
        """Return the heap, in the largest laboratory space."""
        chamber, counts = chambers(request)[0], numbers_in_use(request)
        x, y = chamber.ground.width / 2.0, chamber.ground.depth / 2.0
        pieces: list[RivalPiece] = []
        for large in required_pieces(request):
            home = RivalPiece(named(counts, large.asset), large.asset, x, y, 0.0)
            pieces.append(home)
            for top in large.tops:
                spot = home.surface(0)
                pieces.append(RivalPiece(named(counts, top), top, spot.x, spot.y, 0.0, spot.z0, home.id, 0))
        return layout_of(request, [(chamber, pieces)], "heap", {})
