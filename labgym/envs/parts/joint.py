"""A sensor that joins the readings of others."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces

from labgym.envs.parts import announced, maps, odometry, rays, vectors  # noqa: F401 - a part may be named by its kind
from labgym.envs.parts.protocols import Reading, Sensor
from labgym.envs.parts.registry import parts_of, registered
from labgym.errors import OptionError
from labgym.scenes.rays import Geometry

if TYPE_CHECKING:
    from labgym.envs.state import State


@registered("sensor")
@dataclass(frozen=True)
class JointSensor(Sensor):
    """The readings of several sensors as one float32 vector, one after the other.

    Attributes:
        sensors: the sensors; their readings are flattened.
    """

    name: str = "observation"
    sensors: tuple[Sensor, ...] = ()
    kind: str = field(default="joint", init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "sensors", parts_of(self.sensors, "sensor"))
        if not self.sensors:
            raise OptionError("JointSensor: sensors is empty; it needs at least one")

    @property
    def space(self) -> spaces.Space[Any]:
        """The limits of all components."""
        boxes = [sensor.space for sensor in self.sensors]
        low, high = (np.concatenate([getattr(box, end).ravel() for box in boxes]) for end in ("low", "high"))
        return spaces.Box(low.astype(np.float32), high.astype(np.float32))

    @property
    def sees(self) -> Geometry | None:
        """The visual shapes if one of the sensors sees them."""
        geometries = {sensor.sees for sensor in self.sensors}
        return "visual" if "visual" in geometries else "solid" if "solid" in geometries else None

    def reset(self, state: State, rng: np.random.Generator) -> None:
        """Begin an episode."""
        for sensor in self.sensors:
            sensor.reset(state, rng)

    def reading(self, state: State, rng: np.random.Generator) -> Reading:
        """Return the joint vector."""
        readings = [np.asarray(sensor.reading(state, rng)).ravel() for sensor in self.sensors]
        return np.concatenate(readings).astype(np.float32, copy=False)
