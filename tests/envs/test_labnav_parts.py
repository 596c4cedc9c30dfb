"""Parts that LabNav adds: the announced goal, endings by contact and by being stuck among people, contacts by name."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.envs import LabPointNavEnv
from labgym.envs.conditions.bodies import Body
from labgym.envs.parts.actions import SlippingActions
from labgym.envs.parts.endings import (
    LimitEnding,
    RestEnding,
    StopEnding,
    StuckEnding,
    TouchedEnding,
    TouchEnding,
    nearest_person,
)
from labgym.envs.parts.odometry import AnnouncedGoalSensor, OdometrySensor, OdometryVelocitySensor
from labgym.envs.parts.protocols import Presence
from labgym.envs.parts.vectors import GoalSensor, VelocitySensor
from labgym.errors import OptionError

LAYOUT = island_laboratory()
OPTIONS = {"start": (1.5, 4.2, 0.3), "goal": (6.5, 4.0, 0.0)}


def env(**fields):
    return LabPointNavEnv(layout=LAYOUT, **fields)


def test_without_drift_the_announced_goal_is_the_goal():
    both = env(sensors=(OdometrySensor(), AnnouncedGoalSensor(), GoalSensor(name="true"), VelocitySensor()))
    observation, _ = both.reset(seed=0, options=OPTIONS)
    for step in range(15):
        np.testing.assert_allclose(observation["goal"], observation["true"], atol=1e-5)
        observation = both.step(np.array([1.0, math.sin(step)]))[0]


def test_with_drift_it_has_the_error_of_the_odometry():
    both = env(sensors=(OdometrySensor(heading=20.0), AnnouncedGoalSensor(), GoalSensor(name="true")))
    observation, _ = both.reset(seed=0, options=OPTIONS)
    goal = observation["true"]
    start = np.array([goal[0] * goal[1], goal[0] * goal[2]])
    for _ in range(15):
        observation = both.step(np.array([1.0, 0.0]))[0]
        x, y, cosine, sine = observation["odometry"]
        away = start - (x, y)
        assert observation["goal"][0] == pytest.approx(np.hypot(*away), abs=1e-4)
        expected = math.atan2(away[1], away[0]) - math.atan2(sine, cosine)
        assert math.atan2(observation["goal"][2], observation["goal"][1]) == pytest.approx(expected, abs=1e-4)
    assert not np.allclose(observation["goal"], observation["true"], atol=1e-3)


def test_it_needs_odometry_before_it():
    with pytest.raises(OptionError, match="odometry sensor before it"):
        env(sensors=(AnnouncedGoalSensor(), OdometrySensor())).reset(seed=0)


class People:
    """A condition with a person at a place."""

    name = "people"

    def __init__(self, x, y):
        self.place = (x, y, 0.0)

    def draw(self, task, rng):
        return None

    def prepare(self, task, data):
        return task

    def begin(self, state, data, rng):
        place = self.place

        class Person(Presence):
            visible = False

            @property
            def bodies(self):
                return (Body("person 1", None, place), Body("dog 1", None, (0.0, 0.0, 0.0)))

        return Person()


def stands(seconds, **fields):
    """The time at which a robot that stands is stuck; None if not within `seconds`."""
    one = env(endings=(StuckEnding(duration=2.0, **fields.pop("stuck", {})),), **fields)
    one.reset(seed=0, options=OPTIONS)
    for _ in range(round(10 * seconds)):
        *_, terminated, _, info = one.step(np.zeros(2))
        if terminated:
            return info["time"]
    return None


def test_the_clock_stands_while_a_person_is_near():
    near, far = People(1.5, 3.0), People(1.5, 2.0)
    assert stands(5.0, conditions=[near], stuck={"people": 1.5}) is None
    assert stands(5.0, conditions=[far], stuck={"people": 1.5}) == pytest.approx(2.0)
    assert stands(5.0, conditions=[near]) == pytest.approx(2.0)


def test_the_clock_stands_near_the_goal():
    assert stands(5.0, stuck={"goal": 6.0}) is None
    assert stands(5.0, stuck={"goal": 4.0}) == pytest.approx(2.0)


def test_the_nearest_person_is_the_nearest_body_of_that_name():
    one = env(conditions=[People(4.5, 8.2)])
    one.reset(seed=0, options=OPTIONS)
    assert nearest_person(one.state) == pytest.approx(5.0)
    plain = env()
    plain.reset(seed=0)
    assert nearest_person(plain.state) == math.inf


AGAINST = {"start": (2.0, 2.5, 0.0), "goal": (6.5, 4.0, 0.0)}


@pytest.mark.parametrize(
    ("ending", "ends"),
    [(TouchedEnding(), True), (TouchedEnding(("person",)), False), (TouchedEnding(("Island",)), True)],
)
def test_only_the_named_things_end_a_drive(ending, ends):
    one = env(endings=(ending,), conditions=("contacts",), measures=("outcomes", "ending", "time"))
    one.reset(seed=0, options=AGAINST)
    for _ in range(25):
        *_, terminated, _, info = one.step(np.array([1.0, 0.0]))
        if terminated:
            break
    assert terminated is ends
    assert info["outcomes"]["contacts"] == ["IslandBench1800_1"]
    assert info["ending"] == ("contact" if ends else "")


def test_contacts_change_no_motion():
    poses = []
    for conditions in ((), ("contacts",)):
        one = env(conditions=conditions)
        one.reset(seed=0, options=AGAINST)
        for step in range(25):
            one.step(np.array([1.0, 0.2 * math.sin(step)]))
        poses.append(one.state.pose)
    assert poses[0] == poses[1]


def test_velocities_by_odometry_add_up_to_its_pose():
    one = env(sensors=(OdometrySensor(along=0.02, heading=3.0, turning=3.0), OdometryVelocitySensor()))
    observation, _ = one.reset(seed=0, options=OPTIONS)
    x = y = yaw = 0.0
    for step in range(30):
        observation = one.step(np.array([0.6, math.sin(step)]))[0]
        v, w = (float(each) for each in observation["velocity"])
        x += 0.1 * v * math.cos(yaw + 0.05 * w)
        y += 0.1 * v * math.sin(yaw + 0.05 * w)
        yaw += 0.1 * w
    np.testing.assert_allclose(observation["odometry"][:2], (x, y), atol=0.02)
    assert math.atan2(observation["odometry"][3], observation["odometry"][2]) == pytest.approx(yaw, abs=0.01)


def test_wheels_slip_by_the_deviations_and_agents_cannot_tell_from_their_commands():
    actions, state = SlippingActions(scale=0.05, veer=4.0), env()
    state.reset(seed=0)
    actions.space(state.state.robot)
    drawn = []
    for seed in range(2000):
        actions.reset(state.state, np.random.default_rng(seed))
        ((v, w),) = actions.commands(np.array([1.0, 0.0]), state.state, None)
        ((_, turn),) = actions.commands(np.array([0.0, 1.0]), state.state, None)
        drawn.append((v, w / v, turn))
    v, veer, turn = np.array(drawn).T
    assert (v.mean(), v.std()) == pytest.approx((1.0, 0.05), rel=0.06)
    assert turn.mean() == pytest.approx(1.5, rel=0.01)
    assert turn.std() == pytest.approx(1.5 * 0.05, rel=0.06)
    assert np.degrees(np.median(np.abs(veer))) == pytest.approx(0.6745 * 4.0, rel=0.06)


def test_slipping_needs_a_robot_that_drives_forward_and_turns():
    with pytest.raises(OptionError, match="expected forward, turn"):
        env(actions={"kind": "slipping"}, robot="holonomic")


def still(**changes):
    """Return what endings read of a robot at rest far from its goal, with changes."""
    usual = {"pose": (0.0, 0.0, 0.0), "time": 0.0, "distance": 9.0, "velocity": (0.0, 0.0), "sideways": 0.0}
    return SimpleNamespace(**{**usual, "presences": {}, "stop": False, **changes})


@pytest.mark.parametrize(
    ("ending", "within", "beyond"),
    [
        (TouchEnding(), {"distance": 0.5}, {"distance": 0.501}),
        (RestEnding(), {"distance": 0.36}, {"distance": 0.361}),
        (RestEnding(), {"distance": 0.2, "velocity": (0.0499, 0.0)}, {"distance": 0.2, "velocity": (0.0501, 0.0)}),
        (RestEnding(), {"distance": 0.2, "sideways": -0.0499}, {"distance": 0.2, "sideways": -0.0501}),
        (RestEnding(), {"distance": 0.2, "velocity": (0.0, -0.1)}, {"distance": 0.2, "velocity": (0.0, -0.101)}),
        (StopEnding(), {"distance": 0.36, "stop": True}, {"distance": 0.361, "stop": True}),
        (LimitEnding(), {"time": 120.0}, {"time": 119.9}),
        (StuckEnding(), {"time": 30.0, "pose": (0.0, 0.3, 0.0)}, {"time": 30.0, "pose": (0.0, 0.301, 0.0)}),
        (StuckEnding(), {"time": 30.0}, {"time": 29.9}),
    ],
    ids=lambda value: value.kind if hasattr(value, "kind") else "",
)
def test_the_limits_of_endings_are_those_of_the_documentation(ending, within, beyond):
    for changes, holds in ((within, True), (beyond, False)):
        if hasattr(ending, "reset"):
            ending.reset(still())
        verdict = ending.verdict(still(**changes))
        if isinstance(ending, StopEnding):
            assert verdict == ("success" if holds else "failure")
        else:
            assert verdict == (ending.outcome if holds else None)


def test_rest_counts_from_when_it_began():
    ending = RestEnding(duration=1.0)
    ending.reset(still())
    held = [ending.holds(still(time=t, distance=d)) for t, d in ((0.0, 0.3), (0.9, 0.3), (1.0, 0.3), (1.5, 0.4))]
    held += [ending.holds(still(time=t, distance=0.3)) for t in (2.0, 2.9, 3.0)]
    assert held == [False, False, True, False, False, False, True]


def test_the_clock_of_a_stuck_robot_begins_anew_where_it_went_and_stands_while_people_are_near():
    def near(away):
        return {"people": SimpleNamespace(bodies=(Body("person 1", None, (away, 0.0, 0.0)),))}

    ending = StuckEnding(duration=2.0, people=1.0)
    ending.reset(still(time=5.0))
    steps = [(6.0, 0.0, 9.0), (6.9, 0.4, 9.0), (8.8, 0.4, 9.0), (8.9, 0.4, 9.0)]
    held = [ending.holds(still(time=t, pose=(x, 0.0, 0.0), presences=near(a))) for t, x, a in steps]
    assert held == [False, False, False, True]
    ending.reset(still())
    held = [
        ending.holds(still(time=t, presences=near(a))) for t, a in ((1.0, 0.999), (2.0, 1.0), (2.9, 0.5), (4.0, 2.0))
    ]
    assert held == [False, False, False, True]


@pytest.mark.parametrize(
    ("kind", "field", "value"),
    [
        *((TouchEnding, "radius", value) for value in (0.0, -1.0)),
        *((RestEnding, name, 0.0) for name in ("radius", "speed", "turn_rate")),
        (RestEnding, "duration", -0.1),
        (StopEnding, "radius", 0.0),
        (LimitEnding, "duration", 0.0),
        *((StuckEnding, name, 0.0) for name in ("radius", "duration")),
        *((StuckEnding, name, -0.1) for name in ("people", "goal")),
    ],
)
def test_limits_of_endings_that_make_no_sense_are_refused(kind, field, value):
    with pytest.raises(OptionError, match=field):
        kind(**{field: value})
