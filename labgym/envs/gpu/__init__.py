"""Many robots on a GPU: motion, contacts, lidar and depth by Warp kernels (extra `warp`).

The kernels repeat `labgym.envs.planar` in double precision and cast rays against the meshes that Embree casts against.
They also run on Warp's CPU backend, where they are tested. docs/performance.md says how far they agree.
"""

from __future__ import annotations

from typing import Any

from labgym.errors import OptionError, optional_package

with optional_package("warp-lang", "the vector environment on a device (device=...)", "warp"):
    import warp as wp

__all__ = ["device_of", "wp"]

wp.config.log_level = wp.LOG_WARNING


def device_of(name: str) -> Any:
    """Return a device by its name in Warp: "cpu", "cuda" for the present GPU, or "cuda:0" and so on.

    Raises:
        OptionError: Warp has no such device here.
    """
    names = ["cpu", *(["cuda"] if wp.is_cuda_available() else []), *(str(each) for each in wp.get_cuda_devices())]
    if not isinstance(name, str) or name not in names:
        raise OptionError(f"device is {str(name)[:40]!r}; this machine has {', '.join(names)}")
    return wp.get_device(name)
