"""Many environments at once, for Gymnasium and stable-baselines3: on threads of one process, or in processes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from labgym.envs.presets import configured
from labgym.envs.vector.arguments import kernel_has
from labgym.envs.vector.processes import ProcessPointNavEnv
from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.envs.vector.env import VectorPointNavEnv

SETTINGS = ("autoreset_mode", "max_episode_steps")
"""Arguments of a vector environment that are no fields of `PointNavConfig`."""


def vector_env(
    num_envs: int = 1,
    *,
    threads: int | None = None,
    device: str | None = None,
    processes: int | None = None,
    config: Any = None,
    **options: Any,
) -> VectorPointNavEnv | ProcessPointNavEnv:
    """Return many environments that step together; `gym.make_vec(..., vectorization_mode="vector_entry_point")` does.

    The physics is "planar" unless `physics` is passed. Whatever the class, all that Gymnasium returns equals what
    single environments with the same arguments, physics and seeds return, to the bit; on a device, nearly.

    Args:
        num_envs: number of environments.
        threads: number of threads of a `VectorPointNavEnv`; None for one per processor.
        device: a device of Warp that steps the robots of a `VectorPointNavEnv`.
        processes: number of worker processes of a `ProcessPointNavEnv`; None for threads if the planar kernel has all
            parts, otherwise for one process per processor.
        config, options: as of these classes.

    Raises:
        OptionError: a value is out of range, or `threads` or `device` was passed and the planar kernel lacks a part.
        LabgymError: as `LabPointNavEnv`.
    """
    settings = {name: options.pop(name) for name in SETTINGS if name in options}
    config = configured(config, {"physics": "planar", **options})
    kernel = threads is not None or device is not None
    if processes is None and (kernel or kernel_has(config)):
        from labgym.envs.vector.env import VectorPointNavEnv

        return VectorPointNavEnv(
            num_envs, threads=threads, device=device, config=config, physics=config.physics, **settings
        )
    if kernel:
        raise OptionError("pass processes, or threads or a device, not both")
    return ProcessPointNavEnv(num_envs, processes=processes, config=config, **settings)
