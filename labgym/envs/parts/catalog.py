"""The modules of all parts of ours: each registers its parts under their kinds when it is imported."""

from labgym.envs.conditions import (  # noqa: F401
    changes,
    glass,
    parked,
    payload,
    people,
    station,
    wet,
)
from labgym.envs.parts import (  # noqa: F401
    actions,
    actuation,
    endings,
    goals,
    maps,
    measures,
    mjcf,
    noise,
    odometry,
    randomizations,
    rays,
    rewards,
    robots,
    vectors,
)
