"""Slosh: the frequency of a beaker, the exact integration against another one, and a resonance in closed form."""

from __future__ import annotations

import math

import gymnasium as gym
import numpy as np
import pytest
from laboratories import island_laboratory
from scipy.integrate import solve_ivp
from scipy.special import jvp

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.conditions.beaker import ROOT, Beaker
from labgym.envs.conditions.payload import Slosh, propagator
from labgym.envs.parts.protocols import Motion
from labgym.errors import OptionError

DT = 0.005
LAYOUT = island_laboratory()


def run(beaker, velocity, seconds, heading=0.0):
    """Drive along a heading with the forward velocity of a function of time; return rises at all steps."""
    slosh = Slosh(beaker, (0.0, 0.0, heading), (velocity(0.0), 0.0), 0.0)
    rises = []
    for step in range(1, round(seconds / DT) + 1):
        time = step * DT
        slosh.substep(Motion(time, DT, (0.0, 0.0, heading), (velocity(time), 0.0), 0.0))
        rises.append(slosh.rise)
    return np.array(rises), slosh


def test_the_root_is_that_of_the_derivative_of_bessels_function():
    assert jvp(1, ROOT) == pytest.approx(0.0, abs=2e-4)


def test_a_liter_beaker_sloshes_at_three_hertz():
    assert Beaker().frequency / (2.0 * math.pi) == pytest.approx(2.965, abs=0.01)


@pytest.mark.parametrize("damping", [0.0, 0.005, 0.3])
def test_the_step_is_exact_for_any_duration(damping):
    frequency, force, start = 18.6, 1.3, np.array([0.01, -0.2])
    for dt in (0.005, 0.1, 0.7):
        solved = solve_ivp(
            lambda _, q: [q[1], force - 2.0 * damping * frequency * q[1] - frequency**2 * q[0]],
            (0.0, dt),
            start,
            rtol=1e-11,
            atol=1e-13,
        ).y[:, -1]
        transition, response = propagator(frequency, damping, dt)
        np.testing.assert_allclose(transition @ start + response * force, solved, rtol=1e-7, atol=1e-10)


def test_an_undamped_liquid_rises_twice_as_high_as_under_a_steady_acceleration():
    beaker = Beaker(damping=0.0)
    rises, _ = run(beaker, lambda time: 1.5 * time, 1.0)
    still = beaker.rise(1.5 / beaker.frequency**2)
    assert rises.max() == pytest.approx(2.0 * still, rel=2e-3)


def test_the_rise_does_not_depend_on_the_heading():
    ahead, _ = run(Beaker(), lambda time: min(1.0, 1.5 * time), 2.0)
    across, _ = run(Beaker(), lambda time: min(1.0, 1.5 * time), 2.0, heading=1.1)
    np.testing.assert_allclose(across, ahead, atol=1e-12)


def test_ramps_of_one_and_a_half_meters_per_second_squared_spill_ten_millimeters():
    """Ramps of 1.5 m/s2 let the liquid rise by 12 to 14 mm; ramps of 0.5 m/s2 stay within the freeboard."""
    _, fast = run(Beaker(), lambda time: min(1.0, 1.5 * time), 3.0)
    _, slow = run(Beaker(), lambda time: min(1.0, 0.5 * time), 3.0)
    assert 0.011 < fast.outcome["highest"] < 0.017
    assert fast.outcome["spilt"]
    assert not slow.outcome["spilt"]


def test_a_car_that_turns_at_speed_spills_though_its_speed_is_constant():
    slosh = Slosh(Beaker(), (0.0, 0.0, 0.0), (1.0, 0.0), 0.0)
    for step in range(1, 400):
        slosh.substep(Motion(step * DT, DT, (0.0, 0.0, 1.5 * step * DT), (1.0, 1.5), 0.0))
    assert slosh.outcome["spilt"]


def make(**options):
    return gym.make(
        "LabFloorNav-v0",
        layout=LAYOUT,
        measures=("pose", "path_length", "contacts", "outcomes", "conditions", "touched"),
        disable_env_checker=True,
        **options,
    )


@pytest.mark.parametrize("physics", ["mujoco", "planar"])
def test_an_environment_reports_the_rise_and_moves_as_without_a_payload(physics):
    if physics == "planar":
        pytest.importorskip("numba")
    loaded, empty = make(conditions=["payload"], physics=physics), make(physics=physics)
    loaded.reset(seed=3)
    empty.reset(seed=3)
    rng = np.random.default_rng(0)
    contacts = 0
    for _ in range(60):
        action = np.clip(rng.normal((0.6, 0.0), 0.5), -1.0, 1.0).astype(np.float32)
        first, _, _, _, info = loaded.step(action)
        second, _, _, _, other = empty.step(action)
        for name, reading in first.items():
            np.testing.assert_array_equal(reading, second[name])
        np.testing.assert_array_equal(info["pose"], other["pose"])
        # Contacts are checked after each physics step, not only every 25 ms.
        assert info["contacts"] >= other["contacts"]
        assert bool(info["touched"]) == (info["contacts"] > contacts)
        contacts = info["contacts"]
    assert info["outcomes"]["payload"]["highest"] > 0.001
    assert info["conditions"]["payload"]["radius"] == 0.052
    loaded.close()
    empty.close()


@pytest.mark.parametrize(
    "value", [{"radius": -1.0}, {"width": 1.0}, 7, {"damping": "x"}, {"kind": "payload", "beaker": {"radius": 0.0}}]
)
def test_beakers_that_are_none_are_refused(value):
    condition = value if isinstance(value, dict) and "kind" in value else {"kind": "payload", "beaker": value}
    with pytest.raises(OptionError):
        make(conditions=[condition])
