"""A proposer that makes mistakes: the solver's laboratory with furniture pushed into other furniture."""

from __future__ import annotations

import numpy as np

from labgym.layouts import Layout
from labgym.layouts.interiors import FloorProposer
from labgym.layouts.moves import Move, apply
from labgym.layouts.request import Request


class Shaken:
    """Pushes three pieces of furniture by 0.3 m, in directions that the seed draws."""

    def propose(self, request: Request) -> Layout:
        """Return a layout with collisions and objects out of bounds."""
        layout = FloorProposer().propose(request)
        generator = np.random.default_rng(request.seed)
        furniture = [placement.id for placement in layout.placements if placement.support == "floor"]
        for name in generator.choice(furniture, 3, replace=False):
            angle = generator.uniform(0.0, 2.0 * np.pi)
            layout = apply(layout, Move(str(name), 0.3 * float(np.cos(angle)), 0.3 * float(np.sin(angle))))
        return layout


class Forgetful:
    """Leaves out one instrument that the protocol requires."""

    def propose(self, request: Request) -> Layout:
        """Return a layout without the first required instrument that carries nothing."""
        layout = FloorProposer().propose(request)
        carriers = {placement.support for placement in layout.placements}
        required = set(request.protocol.instruments)
        loose = (p for p in layout.placements if p.asset in required and p.id not in carriers)
        forgotten = next(loose).asset
        return layout.replace(placements=tuple(p for p in layout.placements if p.asset != forgotten))
