"""The value of a path on the true map: the critic's labels."""

from __future__ import annotations

from collections.abc import Sequence

from torch import Tensor

from labgym.policies.data.maps import Maps
from labgym.policies.learned.map_stack import MapStack
from labgym.policies.navdp.config import NavDPLossOptions


def distance_maps(maps: Sequence[Maps]) -> MapStack:
    """Return the distances to the nearest obstacle, meters, sampled bilinearly; everything outside is an obstacle."""
    return MapStack(maps, [each.distance for each in maps], "bilinear", "zero")


def path_value(distance: Tensor, options: NavDPLossOptions) -> Tensor:
    """Return the value (b,) of paths from the distances (b, n) of their points to the nearest obstacle, meters."""
    unsafe = (distance < options.margin).float().mean(dim=1)
    return options.unsafe * unsafe + options.opening * (distance[:, -1] - distance[:, 0])
