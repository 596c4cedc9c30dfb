"""Randomizations of the physics, of sensors and of colors, drawn anew for each episode.

Names follow mjlab and robosuite: a range of factors on masses or frictions, of offsets of sensors, of factors on noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import is_dataclass, replace
from typing import Any

import numpy as np

from labgym.counts import is_finite, is_real
from labgym.envs.checks import positive
from labgym.envs.parts.protocols import Randomization
from labgym.envs.parts.rays import CameraSensor, LidarSensor
from labgym.envs.parts.registry import registered
from labgym.envs.robot import PREFIX
from labgym.envs.setting import EpisodeSetting, Palette, floor_geoms, robot_bodies, robot_geoms
from labgym.errors import OptionError, check_name
from labgym.scenes.mesh import MATERIAL_NAMES

Range = tuple[float, float]


@registered("randomization", "mass")
class MassRandomization(Randomization):
    """A factor on masses and inertias. The forces of the robot's servos stay, so that its accelerations change.

    Attributes:
        factor: smallest and largest factor.
        of: "robot", or "objects" for all that moves in an interactive scene, each with its own factor.
    """

    name: str = "mass"
    factor: Range = (0.8, 1.2)
    of: str = "robot"

    def __post_init__(self) -> None:
        object.__setattr__(self, "factor", checked_range(self, "factor", above=0.0))
        _check_of(self.of, ("robot", "objects"))

    def randomize(self, setting: EpisodeSetting, rng: np.random.Generator) -> Any:
        """Scale masses and inertias; return the factor, or the factors of the objects by name."""
        if self.of == "robot":
            factor = _uniform(self.factor, rng)
            for model in setting.models:
                own = robot_bodies(model)
                model.body_mass[own] *= factor
                model.body_inertia[own] *= factor
            return factor
        model = setting.models[0]
        moving = np.flatnonzero((model.body_dofnum > 0) & ~robot_bodies(model))
        factors = rng.uniform(*self.factor, len(moving))
        model.body_mass[moving] *= factors
        model.body_inertia[moving] *= factors[:, None]
        return {model.body(body).name: float(factor) for body, factor in zip(moving.tolist(), factors, strict=True)}


@registered("randomization", "friction")
class FrictionRandomization(Randomization):
    """A factor on friction.

    Attributes:
        factor: smallest and largest factor.
        of: "robot": the friction of its geoms, wheels included, and the grip of a base without real wheels; "floor":
            that of the floor, which MuJoCo reads for robots from files whose geoms have no priority.
    """

    name: str = "friction"
    factor: Range = (0.5, 1.5)
    of: str = "robot"

    def __post_init__(self) -> None:
        object.__setattr__(self, "factor", checked_range(self, "factor", above=0.0))
        _check_of(self.of, ("robot", "floor"))

    def randomize(self, setting: EpisodeSetting, rng: np.random.Generator) -> float:
        """Scale the frictions and return the factor."""
        factor = _uniform(self.factor, rng)
        for model in setting.models:
            geoms = robot_geoms(model) if self.of == "robot" else floor_geoms(model)
            model.geom_friction[geoms] *= factor
            if self.of == "robot":
                grips = [model.actuator(index).name == PREFIX + "grip" for index in range(model.nu)]
                model.actuator_forcerange[np.flatnonzero(grips)] *= factor
        return factor


@registered("randomization", "sensor_pose")
class SensorPoseRandomization(Randomization):
    """Errors of the places of lidars and cameras, each uniform between minus and plus its largest value.

    Attributes:
        sensors: names of the sensors; empty for all lidars and cameras.
        forward, left, height: largest offsets, meters. yaw: largest turn, degrees, counter-clockwise.
        pitch, roll: the same of cameras, nose down and right side down.
    """

    name: str = "sensor_pose"
    sensors: tuple[str, ...] = ()
    forward: float = 0.01
    left: float = 0.01
    height: float = 0.01
    yaw: float = 1.0
    pitch: float = 1.0
    roll: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "sensors", _names(self.sensors))
        for name in (*LENGTHS, *ANGLES):
            value = getattr(self, name)
            if not is_real(value) or not 0.0 <= value <= 180.0:
                raise OptionError(f"SensorPoseRandomization: {name} is {value!r}, expected a number of at least 0")

    def randomize(self, setting: EpisodeSetting, rng: np.random.Generator) -> dict[str, dict[str, float]]:
        """Move the sensors; return their offsets by name, meters and degrees. Equal cameras move together."""
        drawn: dict[str, dict[str, float]] = {}
        cameras: dict[Any, dict[str, float]] = {}
        for name, sensor in setting.named(self.sensors, (LidarSensor, CameraSensor)).items():
            errors = rng.uniform(-1.0, 1.0, 6)
            offsets = {each: float(error * getattr(self, each)) for each, error in zip(ALL, errors, strict=True)}
            if isinstance(sensor, CameraSensor):
                offsets = cameras.setdefault(sensor._optics, offsets)
            elif isinstance(sensor, LidarSensor):
                offsets = {each: offsets[each] for each in (*LENGTHS, "yaw")}
            else:
                raise OptionError(f"SensorPoseRandomization: sensor {name!r} is no lidar and no camera")
            # Whole millimeters, so that episodes share the planes in which a lidar sees a layout.
            offsets["height"] = round(offsets["height"], 3)
            places = {
                each: getattr(sensor, each) + (offset if each in LENGTHS else math.radians(offset))
                for each, offset in offsets.items()
            }
            setting.sensors[name] = replace(sensor, **places)
            drawn[name] = offsets
        return drawn


LENGTHS, ANGLES = ("forward", "left", "height"), ("yaw", "pitch", "roll")
ALL = (*LENGTHS, *ANGLES)


@registered("randomization", "noise")
class NoiseRandomization(Randomization):
    """A factor on the errors of sensors: the deviations of their noise models, and the drift of odometry.

    Attributes:
        factor: smallest and largest factor. sensors: names of the sensors; empty for all that have errors.
    """

    name: str = "noise"
    factor: Range = (0.5, 2.0)
    sensors: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "factor", checked_range(self, "factor"))
        object.__setattr__(self, "sensors", _names(self.sensors))

    def randomize(self, setting: EpisodeSetting, rng: np.random.Generator) -> dict[str, float]:
        """Scale the errors; return the factor of each sensor by name."""
        drawn: dict[str, float] = {}
        for name, sensor in setting.named(self.sensors).items():
            factor = _uniform(self.factor, rng)
            louder = with_errors(sensor, factor)
            if louder is not None:
                setting.sensors[name], drawn[name] = louder, factor
            elif self.sensors:
                raise OptionError(f"NoiseRandomization: sensor {name!r} has no errors to scale: pass it a noise")
        return drawn


def with_errors(sensor: Any, factor: float) -> Any | None:
    """Return a sensor with its errors multiplied; None if it has none.

    Raises:
        OptionError: a noise model of it cannot be scaled.
    """
    changed = sensor.scaled(factor) if hasattr(sensor, "scaled") else None
    noise = getattr(sensor, "noise", ())
    if noise and is_dataclass(sensor):
        for each in noise:
            if not hasattr(each, "scaled"):
                raise OptionError(f"{type(each).__name__} has no method scaled(factor), which randomized noise needs")
        changed = replace(sensor if changed is None else changed, noise=tuple(each.scaled(factor) for each in noise))  # type: ignore[type-var]
    return changed


def checked_range(part: Any, name: str, above: float | None = None) -> Range:
    """Return a range (low, high) of finite numbers.

    Raises:
        OptionError: not two numbers in ascending order, or not above a limit.
    """
    value = getattr(part, name)
    numbers = list(value) if isinstance(value, list | tuple) else []
    valid = len(numbers) == 2 and all(map(is_finite, numbers))
    least = 0.0 if above is None else above
    if not valid or not least <= numbers[0] <= numbers[1] or (above is not None and numbers[0] <= above):
        limit = "at least 0" if above is None else f"above {above:g}"
        raise OptionError(f"{type(part).__name__}: {name} is {str(value)[:40]!r}, expected [low, high], {limit}")
    return float(numbers[0]), float(numbers[1])


def _names(names: Any) -> tuple[str, ...]:
    if isinstance(names, str):
        return (names,)
    if isinstance(names, Mapping) or not isinstance(names, list | tuple):
        raise OptionError(f"sensors are {type(names).__name__}, expected names of sensors")
    return tuple(names)


def _check_of(value: str, names: tuple[str, ...]) -> None:
    check_name("object of a randomization", value, names)


def _uniform(limits: Range, rng: np.random.Generator) -> float:
    return float(rng.uniform(*limits))


@registered("randomization", "appearance")
class AppearanceRandomization(Randomization):
    """Factors on the colors of materials and on the brightness of everything. Depth and lidar do not change.

    Attributes:
        tint: the red, green and blue of each material are multiplied by factors between 1 - tint and 1 + tint.
        brightness: all colors are multiplied by a factor between 1 - brightness and 1 + brightness.
    """

    name: str = "appearance"
    tint: float = 0.2
    brightness: float = 0.3

    def __post_init__(self) -> None:
        positive(self, "tint", "brightness", zero=True)

    def randomize(self, setting: EpisodeSetting, rng: np.random.Generator) -> dict[str, Any]:
        """Draw the factors; return the brightness and the tints by material."""
        brightness = float(1.0 + self.brightness * rng.uniform(-1.0, 1.0))
        factors = 1.0 + self.tint * rng.uniform(-1.0, 1.0, (len(MATERIAL_NAMES), 3))
        tints = {name: tuple(factor) for name, factor in zip(MATERIAL_NAMES, factors.tolist(), strict=True)}
        setting.palette = Palette(tints, brightness)
        return {"brightness": brightness, "tints": tints}
