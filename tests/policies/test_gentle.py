from __future__ import annotations

import cmath
import math

import mujoco
import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st

from labgym.envs.conditions.beaker import GRAVITY, Beaker
from labgym.envs.reach import robot_alone
from labgym.envs.robot import ROBOT
from labgym.policies import PathTracker, TrackingOptions
from labgym.policies.gentle import GentleCommands, GentleLimits, shaping_weights
from labgym.policies.tracking import approach_speed

PATHS = {
    "line": [[0.0, 0.0], [5.0, 0.0]],
    "behind": [[0.0, 0.0], [-3.0, 0.0]],
    "corner": [[0.0, 0.0], [2.5, 0.0], [2.5, 2.5]],
    "zigzag": [[0.0, 0.0], [2.0, 0.0], [3.0, 1.0], [4.0, 0.0], [5.0, 1.5]],
}


@given(frequency=st.floats(1.0, 40.0))
def test_the_filter_has_no_gain_at_the_liquids_frequency_and_never_overshoots(frequency):
    weights = shaping_weights(frequency, 0.1)
    assert sum(weights) == pytest.approx(1.0)
    assert min(weights) >= 0.0
    gain = sum(weight * cmath.exp(-1j * frequency * 0.1 * k) for k, weight in enumerate(weights))
    if math.cos(frequency * 0.1 * (len(weights) - 1) / 2.0) <= 0.0:
        assert abs(gain) == pytest.approx(0.0, abs=1e-9)


def test_a_constant_acceleration_at_the_limit_tilts_the_surface_to_half_of_the_freeboard():
    for freeboard in (0.003, 0.005, 0.010):
        beaker = Beaker(freeboard=freeboard)
        limits = GentleLimits.of(beaker)
        # Under a constant acceleration the surface has the slope a / g; the first mode has 0.837 of it.
        rise = 0.837 * beaker.radius * limits.acceleration / GRAVITY
        assert rise == pytest.approx(freeboard / 2.0)
    assert GentleLimits.of(Beaker(freeboard=0.1)).acceleration == ROBOT.acceleration


@given(wanted=st.lists(st.floats(-0.3, 1.0), min_size=1, max_size=40))
def test_commands_never_exceed_the_acceleration_and_the_jerk(wanted):
    limits = GentleLimits.of(Beaker())
    commands = GentleCommands(limits)
    driven = np.array([0.0, 0.0, *(commands.command(v) for v in wanted)])
    step = limits.acceleration * ROBOT.control_dt
    assert np.abs(np.diff(driven)).max() <= step + 1e-12
    variation = np.abs(np.diff([0.0, *limits.weights, 0.0])).sum()
    assert np.abs(np.diff(driven, 2)).max() <= step * variation + 1e-12
    settled = [commands.command(0.5) for _ in range(40)]
    assert settled[-1] == pytest.approx(0.5)


def surface(path, beaker: Beaker, gentle: bool) -> tuple[float, float]:
    """Return the highest rise of the surface on a path, meters, and the distance from its end at the end."""
    model = robot_alone(ROBOT)
    data = mujoco.MjData(model)
    limits = GentleLimits.of(beaker) if gentle else None
    tracker = PathTracker(path, options=TrackingOptions(rest=True), gentle=limits)
    stiffness, friction = beaker.frequency**2, 2.0 * beaker.damping * beaker.frequency
    system = np.array([[0.0, 1.0, 0.0], [-stiffness, -friction, -1.0], [0.0, 0.0, 0.0]])
    advance = scipy.linalg.expm(system * ROBOT.timestep)[:2]
    surface, last, highest = np.zeros((2, 2)), np.zeros(2), 0.0
    for _ in range(300):
        x, y, yaw = data.qpos.tolist()
        forward = float(np.cos(yaw) * data.qvel[0] + np.sin(yaw) * data.qvel[1])
        v, w = ROBOT.twist(*tracker.action((x, y, yaw), forward))
        data.ctrl[:] = v, 0.0, w
        for _ in range(ROBOT.substeps):
            mujoco.mj_step(model, data)
            acceleration = (data.qvel[:2] - last) / ROBOT.timestep
            surface = advance @ np.vstack([surface, acceleration])
            last = data.qvel[:2].copy()
            highest = max(highest, beaker.rise(float(np.linalg.norm(surface[0]))))
        if tracker.ended and np.abs(data.qvel).max() < 1e-3:
            break
    return highest, math.dist(data.qpos[:2], path[-1])


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize("freeboard", [0.005, 0.010, 0.020])
def test_gentle_driving_keeps_the_liquid_in_the_beaker(name, freeboard):
    beaker = Beaker(freeboard=freeboard)
    highest, away = surface(PATHS[name], beaker, gentle=True)
    assert highest < freeboard
    assert away < 0.02


def test_driving_as_usual_spills_it():
    assert surface(PATHS["corner"], Beaker(), gentle=False)[0] > 0.010


@given(distance=st.floats(0.0, 5.0), braking=st.floats(0.2, 2.0))
def test_the_approach_never_brakes_harder_than_allowed(distance, braking):
    near, far = approach_speed(distance, braking), approach_speed(distance + 1e-5, braking)
    assert near * (far - near) / 1e-5 <= braking * (1.0 + 1e-3)
    assert near**2 / (2.0 * braking) <= distance + 1e-12
    assert approach_speed(-1.0, braking) == 0.0


def test_hard_braking_is_sooner_at_rest_and_passes_the_same_filter():
    def stopped(hard: bool) -> tuple[int, float]:
        commands = GentleCommands(GentleLimits.of(Beaker()))
        driven = [commands.command(0.9) for _ in range(30)]
        driven += [commands.command(0.0, hard) for _ in range(30)]
        assert driven[29] == pytest.approx(0.9)
        drops = -np.diff(driven) / ROBOT.control_dt
        return int(np.argmax(np.array(driven[30:]) == 0.0)), float(drops.max())

    (soft_steps, soft), (hard_steps, hard) = stopped(False), stopped(True)
    assert hard_steps < soft_steps
    assert soft < hard < ROBOT.acceleration


@pytest.mark.parametrize("spacing", range(1, 12))
def test_the_filter_of_a_whole_number_of_steps_per_quarter_period_is_not_longer_by_rounding(spacing):
    weights = shaping_weights(math.pi / 2.0 / (spacing * 0.1), 0.1)
    assert len(weights) == 2 * spacing + 1
    assert weights[0] == weights[-1] == pytest.approx(0.5)


def test_hard_braking_takes_93_percent_of_the_robot_s_acceleration():
    commands = GentleCommands(GentleLimits(0.2, 0.2, (1.0,)))
    speeds = [commands.command(1.0) for _ in range(60)] + [commands.command(0.0, hard=True) for _ in range(3)]
    changes = np.diff(speeds) / ROBOT.control_dt
    assert changes[0] == pytest.approx(0.2)
    assert changes[-1] == pytest.approx(-0.93 * ROBOT.acceleration)
    assert commands.speed == commands.history[-1] == speeds[-1]
