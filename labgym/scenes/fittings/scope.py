"""Which floors have installations."""

from __future__ import annotations

from labgym.layouts.floor import Floor


def has_fittings(floor: Floor) -> bool:
    """Whether scenes of a floor show ducts, sockets, cables and hoses, and stored glassware without liquid.

    Floors with service points and floors of any other shape than one rectangular room do. A plain rectangular room, as
    in the published layouts, shows its placements only.
    """
    return bool(floor.services) or not floor.is_rectangle
