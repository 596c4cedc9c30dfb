"""Setting of one episode, which randomizations may change: its own copies of sensors, physics and colors."""

from __future__ import annotations

import copy
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.assembly import Assembly
from labgym.envs.mount import Mount
from labgym.envs.parts.protocols import Sensor
from labgym.envs.parts.vectors import JointSensor
from labgym.envs.robot import PREFIX
from labgym.errors import OptionError, check_name
from labgym.scenes import RayScene
from labgym.scenes.mesh import MATERIAL_NAMES


@dataclass(eq=False)
class Palette:
    """Factors on the colors that cameras see.

    Attributes:
        tints: factors on red, green and blue by material; of others 1. brightness: factor on all colors.
    """

    tints: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    brightness: float = 1.0
    _painted: tuple[RayScene, RayScene] | None = field(default=None, init=False, repr=False)

    def factors(self, name: str) -> NDArray[np.float64]:
        """Return the factors on red, green and blue of a material, (3,)."""
        return np.array(self.tints.get(name, (1.0, 1.0, 1.0))) * self.brightness

    def paint(self, scene: RayScene) -> RayScene:
        """Return a scene in these colors; the latest one is painted once."""
        if self._painted is None or self._painted[0] is not scene:
            factors = np.array([self.factors(name) for name in MATERIAL_NAMES])
            colors = np.clip(scene.colors * factors[scene.mesh.material], 0.0, 255.0).astype(np.float32)
            self._painted = scene, scene.recolored(colors)
        return self._painted[1]

    def __getstate__(self) -> dict[str, object]:
        # The painted scene stays in its process; a copy paints its own.
        return {"tints": dict(self.tints), "brightness": self.brightness, "_painted": None}


@dataclass
class EpisodeSetting:
    """The setting of one episode. Changes here affect this episode alone.

    Attributes:
        assembly: the robot in the layout, compiled; None with the planar kernel. Read `models` to change it.
        sensors: the sensors by name, those of a joint vector as "vector/sensor"; replace entries with sensors of the
            same space.
        vectors: the joint vectors by name.
        palette: colors that cameras see; None for those of the layout.
    """

    assembly: Assembly | None
    sensors: dict[str, Sensor]
    vectors: dict[str, JointSensor] = field(default_factory=dict)
    palette: Palette | None = None
    _models: tuple[mujoco.MjModel, ...] = field(default=(), init=False)

    @classmethod
    def of(cls, assembly: Assembly | None, sensors: Sequence[Sensor]) -> EpisodeSetting:
        """Return the setting of an episode before randomizations."""
        single: dict[str, Sensor] = {}
        vectors: dict[str, JointSensor] = {}
        for sensor in sensors:
            if isinstance(sensor, JointSensor):
                vectors[sensor.name] = sensor
                single |= {f"{sensor.name}/{each.name}": each for each in sensor.sensors}
            else:
                single[sensor.name] = sensor
        return cls(assembly, single, vectors)

    def observed(self, sensors: Sequence[Sensor]) -> tuple[Sensor, ...]:
        """Return the sensors of the observation, in their order, after randomizations.

        Raises:
            OptionError: a sensor of another space took the place of one.
        """
        changed = tuple(self._observed(sensor) for sensor in sensors)
        for sensor, before in zip(changed, sensors, strict=True):
            if sensor is not before and sensor.space != before.space:
                raise OptionError(
                    f"a randomization changed the space of sensor {before.name!r}: keep its shape and range"
                )
        return changed

    def _observed(self, sensor: Sensor) -> Sensor:
        vector = self.vectors.get(sensor.name)
        if vector is None:
            return self.sensors[sensor.name]
        members = tuple(self.sensors[f"{sensor.name}/{each.name}"] for each in vector.sensors)
        same = all(new is old for new, old in zip(members, vector.sensors, strict=True))
        return vector if same else replace(vector, sensors=members)

    @property
    def models(self) -> tuple[mujoco.MjModel, ...]:
        """The MuJoCo models that the physics steps: the scene with the robot, and parts of it that are stepped instead.

        The parts are the robot alone, and the scene without the things that can be pushed.

        Change all of them alike; names of the robot begin with `robot/` in each. Changed masses take effect as a whole:
        quantities that follow from them are computed afterwards.

        Raises:
            OptionError: the physics is the planar kernel.
        """
        if self.assembly is None:
            raise OptionError("the planar kernel has no masses and frictions to randomize: pass physics='mujoco'")
        if not self._models:
            every = (self.assembly.model, self.assembly.alone, self.assembly.quiet)
            self._models = tuple(copy.copy(model) for model in every if model is not None)
        return self._models

    def changed(self) -> Assembly | None:
        """Return the assembly with the changed models."""
        if self.assembly is None or not self._models:
            return self.assembly
        for model in self._models:
            mujoco.mj_setConst(model, mujoco.MjData(model))
        names = [name for name in ("model", "alone", "quiet") if getattr(self.assembly, name) is not None]
        return replace(self.assembly, **dict(zip(names, self._models, strict=True)))

    def named(self, names: Collection[str], kinds: tuple[type[Any], ...] = ()) -> dict[str, Any]:
        """Return the sensors of these names; without names, those of some classes, or all.

        Raises:
            UnknownNameError: no sensor has a name.
        """
        for name in names:
            check_name("sensor", name, self.sensors)
        if names:
            return {name: self.sensors[name] for name in names}
        return {name: each for name, each in self.sensors.items() if not kinds or isinstance(each, kinds)}


def robot_geoms(model: mujoco.MjModel) -> Any:
    """Return which geoms of a model are the robot's, (ngeom,) bool."""
    return robot_bodies(model)[model.geom_bodyid]


def robot_bodies(model: mujoco.MjModel) -> Any:
    """Return which bodies of a model are the robot's, (nbody,) bool."""
    return np.asarray(model.body_rootid == model.body(PREFIX + "base").id)


def floor_geoms(model: mujoco.MjModel) -> Any:
    """Return which geoms of a model are the floor, (ngeom,) bool."""
    return Mount.of(model).floor
