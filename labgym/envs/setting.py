"""What randomizations may change for one episode: its own copies of sensors, physics and colors."""

from __future__ import annotations

import copy
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import mujoco
import numpy as np

from labgym.envs.assembly import Assembly
from labgym.envs.mount import Mount
from labgym.envs.parts.protocols import Sensor
from labgym.envs.robot import PREFIX
from labgym.errors import OptionError, UnknownNameError


@dataclass
class Setting:
    """The setting of one episode. What is changed here belongs to this episode alone.

    Attributes:
        assembly: the robot in the layout, compiled; None with the planar kernel. Read `models` to change it.
        sensors: the sensors by name; replace entries with sensors of the same space.
        tints: factors on the colors that cameras see, (red, green, blue) by material; "" is that of all others.
        brightness: factor on all colors.
    """

    assembly: Assembly | None
    sensors: dict[str, Sensor]
    tints: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    brightness: float = 1.0
    _models: tuple[mujoco.MjModel, ...] = field(default=(), init=False)

    @property
    def models(self) -> tuple[mujoco.MjModel, ...]:
        """The MuJoCo models that the physics steps: the scene with the robot, and the robot alone if it is stepped so.

        Change all of them alike; names of the robot begin with `robot/` in each. Changed masses take effect as a whole:
        quantities that follow from them are computed afterwards.

        Raises:
            OptionError: the physics is the planar kernel.
        """
        if self.assembly is None:
            raise OptionError("the planar kernel has no masses and frictions to randomize: pass physics='mujoco'")
        if not self._models:
            both = (self.assembly.model, self.assembly.alone)
            self._models = tuple(copy.copy(model) for model in both if model is not None)
        return self._models

    @property
    def colored(self) -> bool:
        """Whether colors differ from those of the layout."""
        return bool(self.tints) or self.brightness != 1.0

    def changed(self) -> Assembly | None:
        """Return the assembly with the changed models."""
        if self.assembly is None or not self._models:
            return self.assembly
        for model in self._models:
            mujoco.mj_setConst(model, mujoco.MjData(model))
        model, *alone = self._models
        return replace(self.assembly, model=model, alone=alone[0] if alone else None)

    def named(self, names: Iterable[str], kind: type[Any] | None = None) -> dict[str, Any]:
        """Return the sensors of these names; without names, those of a class.

        Raises:
            UnknownNameError: no sensor has a name.
        """
        for name in names:
            if name not in self.sensors:
                raise UnknownNameError("sensor", name, self.sensors)
        if names:
            return {name: self.sensors[name] for name in names}
        return {name: each for name, each in self.sensors.items() if kind is None or isinstance(each, kind)}


def robot_geoms(model: mujoco.MjModel) -> Any:
    """Return which geoms of a model are the robot's, (ngeom,) bool."""
    return robot_bodies(model)[model.geom_bodyid]


def robot_bodies(model: mujoco.MjModel) -> Any:
    """Return which bodies of a model are the robot's, (nbody,) bool."""
    return np.asarray(model.body_rootid == model.body(PREFIX + "base").id)


def floor_geoms(model: mujoco.MjModel) -> Any:
    """Return which geoms of a model are the floor, (ngeom,) bool."""
    return Mount.of(model).floor
