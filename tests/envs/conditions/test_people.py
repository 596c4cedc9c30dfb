"""People: places that are free, resting robots that nobody touches, exact futures, contacts and bodies."""

from __future__ import annotations

import copy
import hashlib
import json
import math
import os
import pickle
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import mujoco
import numpy as np
import pytest
from laboratories import island_laboratory
from shapely.geometry import Point, Polygon
from shapely.ops import unary_union

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.conditions.cast import MOST, RADIUS, cast_of, free_floor
from labgym.envs.conditions.crowd import Crowd
from labgym.envs.conditions.figures import LEG_APART, figure
from labgym.envs.conditions.intentions import STOP
from labgym.envs.conditions.orca import Disc
from labgym.envs.conditions.people import People
from labgym.envs.conditions.social_force import SocialForce, interaction, pushed
from labgym.envs.view import add_shapes, place_bodies
from labgym.envs.world import world_of
from labgym.errors import LabgymError, OptionError
from labgym.eval.drawing.film import film
from labgym.navigation import OBSTACLE_HEIGHT
from labgym.scenes.opengl import MissingRendererError

LAYOUT = island_laboratory()
START, GOAL = (1.5, 1.0, 0.0), (6.5, 1.0, 0.0)
STILL = np.zeros(2, dtype=np.float32)
MEASURES = ("pose", "time", "touched", "conditions", "outcomes", "collision")


def make(condition="people", **options):
    options = {"layout": LAYOUT, "measures": MEASURES, "endings": (), **options}
    return gym.make("LabFloorNav-v0", conditions=[condition], disable_env_checker=True, **options)


def begin(env, seed=3):
    env.reset(seed=seed, options={"start": START, "goal": GOAL})
    return env.unwrapped.state.presences["people"]


def put(*people, **fields):
    """Return an environment with people by hand: (x, y, yields, stops)."""
    roles = [
        {"start": [x, y], "yields": yields, "group": k, "stops": [[*stop, 0.0, 3.0] for stop in stops]}
        for k, (x, y, yields, stops) in enumerate(people)
    ]
    env = make()
    (condition,) = env.unwrapped._conditions
    object.__setattr__(condition, "draw", lambda task, rng: {"people": roles, **fields})
    return env


def drawn(layout):
    """Return the floor that a layout leaves free, by shapely."""
    room = Polygon([(0, 0), (layout.room.width, 0), (layout.room.width, layout.room.depth), (0, layout.room.depth)])
    return room.difference(unary_union([Polygon(box.corners()) for box in layout.obstacles(OBSTACLE_HEIGHT)]))


@pytest.mark.parametrize("model", ["orca", "social_force"])
def test_people_never_enter_furniture_or_walls_and_walk(model):
    free = drawn(LAYOUT)
    world = world_of(LAYOUT)
    env = make({"kind": "people", "density": 0.25, "model": model})
    begin(env)
    crowd = Crowd(world, cast_of(env.unwrapped.state.conditions["people"]))
    assert len(crowd.places) == round(0.25 * free_floor(world, START))
    walked = 0.0
    for _ in range(250):
        before = crowd.places
        crowd.step(None, 0.0)
        for (x, y), last in zip(crowd.places, before, strict=True):
            assert free.boundary.distance(Point(x, y)) > RADIUS - 1e-6
            assert free.contains(Point(x, y))
            assert math.dist((x, y), last) < 0.1 + 1e-9
            walked += math.dist((x, y), last)
    assert walked / (25.0 * len(crowd.places)) > 0.3
    assert (crowd._people.marks[:, STOP] > 0).sum() > len(crowd.places) / 2


def test_the_density_is_people_for_each_square_meter_on_which_they_can_stand():
    world = world_of(LAYOUT)
    room = drawn(LAYOUT).buffer(-0.30)
    (standing,) = [part.area for part in getattr(room, "geoms", [room]) if part.contains(Point(START[:2]))]
    # Cells of 5 cm whose square, and all that it meets, is 0.30 m from everything.
    assert 0.85 * standing < free_floor(world, START) < standing
    for density in (0.0, 0.05, 0.2):
        people = len(begin(make({"kind": "people", "density": density})).positions)
        assert people == round(density * free_floor(world, START))


def test_half_of_the_people_yield_and_starts_are_apart():
    begin(env := make({"kind": "people", "density": 0.3}))
    people = env.unwrapped.state.conditions["people"]["people"]
    assert sum(person["yields"] for person in people) == round(0.5 * len(people))
    starts = np.array([person["start"] for person in people])
    assert np.linalg.norm(starts - START[:2], axis=1).min() >= 1.5
    gaps = np.linalg.norm(starts[:, None] - starts, axis=-1)
    assert gaps[~np.eye(len(starts), dtype=bool)].min() >= 0.7
    assert all(2.0 <= stop[3] <= 6.0 for person in people for stop in person["stops"])


def test_members_of_a_group_have_stops_together():
    begin(env := make({"kind": "people", "density": 0.2, "group": 3}))
    people = env.unwrapped.state.conditions["people"]["people"]
    first, second = people[0], people[1]
    assert first["group"] == second["group"] == 0
    assert people[3]["group"] == 1
    for one, other in zip(first["stops"], second["stops"], strict=True):
        assert math.dist(one[:2], other[:2]) <= 1.5
        assert one[2:] == other[2:]


@pytest.mark.parametrize("yields", [True, False])
def test_nobody_walks_into_a_robot_at_rest(yields):
    env = put((4.5, 1.0, yields, [(0.9, 1.0), (4.5, 1.0)]), (5.5, 0.6, yields, [(0.9, 0.6)]))
    begin(env)
    for _ in range(80):
        *_, info = env.step(STILL)
        assert info["touched"] == ()
    assert info["outcomes"]["people"]["least_distance"] >= 0.27 + RADIUS


def driven(*people):
    env = put(*people)
    begin(env)
    return env


def forward(env, steps):
    for _ in range(steps):
        *_, info = env.step(np.array([1.0, 0.0], dtype=np.float32))
        if info["touched"]:
            break
    return info


def test_a_moving_robot_touches_a_person_who_does_not_see_it_and_the_person_has_a_name():
    info = forward(driven((4.5, 1.0, False, [(1.0, 1.0)])), 40)
    assert info["touched"] == ("person 1",)
    assert info["collision"]
    assert info["outcomes"]["people"]["least_distance"] < 0.57


def test_a_robot_that_creeps_is_not_at_rest():
    env = driven((3.2, 1.0, False, [(0.9, 1.0)]))
    for _ in range(60):
        *_, info = env.step(np.array([0.03, 0.0], dtype=np.float32))
        if info["touched"]:
            break
    assert info["touched"] == ("person 1",)


def test_a_robot_that_turns_on_the_spot_counts_as_at_rest():
    env = driven((3.2, 1.0, False, [(0.9, 1.0)]))
    for _ in range(60):
        *_, info = env.step(np.array([0.0, 1.0], dtype=np.float32))
        assert info["touched"] == ()
    assert info["outcomes"]["people"]["least_distance"] >= 0.27 + RADIUS


def test_a_person_who_yields_steps_aside():
    """The robot drives straight at somebody who comes towards it; they take half of the avoidance, again each 0.1 s."""
    blind = forward(driven((4.5, 1.25, False, [(1.0, 1.25)])), 30)
    seen = forward(driven((4.5, 1.25, True, [(1.0, 1.25)])), 30)
    assert blind["touched"]
    assert seen["outcomes"]["people"]["least_distance"] > blind["outcomes"]["people"]["least_distance"]


def test_half_yielding_people_move_as_in_two_synchronized_simulations():
    """One in which everybody sees the robot and one in which nobody does; each person moves as in theirs."""
    env = make({"kind": "people", "density": 0.6})
    begin(env)
    crowd = Crowd(world_of(LAYOUT), cast_of(env.unwrapped.state.conditions["people"]))
    assert 0 < sum(crowd.yields) < len(crowd.yields)
    apart = 0
    for step in range(80):
        robot = Disc(1.5 + 0.06 * step, 1.0, 0.6, 0.0, 0.27)
        seeing, blind = crowd.copy(), crowd.copy()
        seeing.yields, blind.yields = (True,) * len(crowd.yields), (False,) * len(crowd.yields)
        for each in (crowd, seeing, blind):
            each.step(robot, 0.0)
        assert crowd.places == [
            (one if yields else other)
            for yields, one, other in zip(crowd.yields, seeing.places, blind.places, strict=True)
        ]
        apart += seeing.places != blind.places
    assert apart > 10


def test_the_outcome_is_that_of_the_positions():
    env = make({"kind": "people", "density": 0.2})
    people = begin(env)
    rng = np.random.default_rng(0)
    least, close = math.inf, 0.0
    for _ in range(60):
        *_, info = env.step(np.clip(rng.normal((0.5, 0.0), 0.5), -1.0, 1.0).astype(np.float32))
        distance = np.linalg.norm(people.positions - info["pose"][:2], axis=1).min()
        least, close = min(least, distance), close + 0.1 * (distance < 1.0)
        assert info["outcomes"]["people"]["nearest"] == pytest.approx(distance, abs=1e-9)
        assert (info["outcomes"]["people"]["beside_seconds"] > 0.0) == (distance < 1.5)
    assert info["outcomes"]["people"]["least_distance"] == pytest.approx(least, abs=0.1)
    assert info["outcomes"]["people"]["least_distance"] <= least + 1e-9
    assert info["outcomes"]["people"]["close_seconds"] == pytest.approx(close, abs=0.3)


@pytest.mark.parametrize("physics", ["mujoco", "planar"])
def test_futures_are_exact_for_the_path_that_the_robot_takes(physics):
    if physics == "planar":
        pytest.importorskip("numba")
    env = make({"kind": "people", "density": 0.2}, physics=physics)
    people = begin(env)
    forward(env, 7)
    before = copy.deepcopy(people)
    states, places = {}, []
    rng = np.random.default_rng(2)
    for _ in range(25):
        env.step(np.clip(rng.normal((0.4, 0.0), 0.4), -1.0, 1.0).astype(np.float32))
        state = env.unwrapped.state
        (x, y, yaw), (v, turn) = state.pose, state.velocity
        across = state.sideways if physics == "planar" else env.unwrapped._episode.simulation.sideways
        states[round(state.time, 6)] = (
            x,
            y,
            math.cos(yaw) * v - math.sin(yaw) * across,
            math.sin(yaw) * v + math.cos(yaw) * across,
            turn,
        )
        places.append(people.positions)
    futures = before.futures(sorted(states), lambda time: states[round(time, 6)])
    np.testing.assert_allclose(futures, places, atol=1e-9)
    assert np.abs(before.futures(sorted(states)) - places).max() > 0.0


def test_futures_of_the_past_are_refused():
    people = begin(make())
    with pytest.raises(OptionError, match="ascending"):
        people.futures([1.0, 0.5])


def trace(env, actions):
    readings = []
    for action in actions:
        observation, _, _, _, info = env.step(action)
        readings.append((observation["lidar"].tobytes(), info["pose"].tobytes(), json.dumps(info["outcomes"])))
    return readings


ACTIONS = np.random.default_rng(5).uniform(-1.0, 1.0, (30, 2)).astype(np.float32)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_in_the_middle_of_an_episode_goes_on_to_the_bit(copied):
    env = make({"kind": "people", "density": 0.2})
    begin(env)
    trace(env, ACTIONS[:12])
    other = copied(env)
    assert trace(env, ACTIONS[12:]) == trace(other, ACTIONS[12:])


CODE = """
import hashlib, sys
sys.path[:0] = {paths!r}
from test_people import ACTIONS, begin, make, trace
env = make({{"kind": "people", "density": 0.2}})
begin(env)
print(hashlib.sha256(repr(trace(env, ACTIONS)).encode()).hexdigest())
"""


@pytest.mark.slow
def test_another_process_with_another_hash_seed_has_the_same_bytes():
    code = CODE.format(paths=[str(Path(__file__).parent), *sys.path])
    other = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONHASHSEED": "77"},
        capture_output=True,
        text=True,
        check=True,
    )
    env = make({"kind": "people", "density": 0.2})
    begin(env)
    assert other.stdout.strip() == hashlib.sha256(repr(trace(env, ACTIONS)).encode()).hexdigest()


def test_the_lidar_sees_two_legs_and_the_camera_a_person():
    env = driven((3.5, 1.0, True, []))
    state = env.unwrapped.state
    legs = [body for body in state.presences["people"].bodies if body.shape.heights[0] < 0.3]
    assert len(legs) == 2
    origin = np.broadcast_to((1.5, 1.0, 0.25), (721, 3))
    angles = np.linspace(-0.2, 0.2, 721)
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(721)])
    ranges, _ = state.rays("solid").cast(origin, ring)
    hit = ranges < 2.5
    edges = np.flatnonzero(np.diff(np.concatenate([[False], hit, [False]]).astype(int)))
    assert len(edges) == 4
    widths = np.diff(angles[np.clip(edges, 0, 720)])[::2] * 2.0
    assert widths == pytest.approx([0.12, 0.12], abs=0.02)
    assert ranges[hit].min() == pytest.approx(2.0 - 0.06, abs=0.01)
    up = np.array([[1.0, 0.0, 0.0]])
    assert state.rays("visual").cast(np.array([[1.5, 1.0, 1.6]]), up)[0][0] == pytest.approx(1.9, abs=0.05)


def test_pictures_have_the_bodies_at_their_places():
    """The scene of a picture, without drawing it: a ray of MuJoCo meets the torso where the body stands."""
    bodies = figure(0, 2.0, 3.0, 0.7, 0.0, False) + figure(1, 4.0, 3.0, -2.0, 0.0, False)
    spec = mujoco.MjSpec()
    add_shapes(spec, [body.shape for body in bodies])
    data = mujoco.MjData(spec.compile())
    place_bodies(data, bodies)
    mujoco.mj_forward(data.model, data)

    def height(x):
        geom, down = np.zeros(1, dtype=np.int32), np.array([0.0, 0.0, -1.0])
        distance = mujoco.mj_ray(data.model, data, np.array([x, 3.0, 5.0]), down, None, 1, -1, geom)
        return 5.0 - distance if distance >= 0.0 else 0.0

    assert [height(x) for x in (2.0, 3.0, 4.0)] == pytest.approx([1.76, 0.0, 1.76], abs=0.02)
    assert data.model.nbody == 1 + len(bodies)
    assert not (data.model.geom_contype | data.model.geom_conaffinity).any()


def test_the_depth_picture_shows_people():
    env = driven((3.0, 1.0, True, []))
    env.unwrapped.render_mode = "depth_array"
    assert env.render().min() == pytest.approx(1.3 - 0.18, abs=0.08)


def test_a_film_shows_people_where_they_are():
    person = figure(0, 2.2, 1.6, 0.0, 0.0, False)
    try:
        without, with_them = film(LAYOUT, (START, START), 160, 120, bodies=((), person))
    except MissingRendererError:
        pytest.skip("no OpenGL")
    changed = (without != with_them).any(axis=-1)
    assert changed[:, :80].mean() > 0.01  # without the robot's view in the corner
    assert changed.mean() < 0.2


def test_legs_swing_between_a_fifth_and_a_third_of_a_meter_apart():
    for walked in np.linspace(0.0, 1.3, 27):
        _, left, right = figure(0, 2.0, 3.0, 0.7, walked, True)
        assert 2 * LEG_APART - 1e-9 <= math.dist(left.pose[:2], right.pose[:2]) <= 0.30
    _, left, right = figure(0, 2.0, 3.0, 0.7, 0.4, False)
    assert math.dist(left.pose[:2], right.pose[:2]) == pytest.approx(2 * LEG_APART)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("start", [math.nan, 1.0]),
        ("start", [4.0, 2.5]),
        ("start", [1e9, 0.0]),
        ("start", "here"),
        ("group", -1),
        ("group", 10**9),
        ("stops", [[1.0, 1.0, 0.0, -2.0]]),
        ("stops", [[1.0, 1.0, 0.0, 2.0]] * 65),
        ("name", "Ada"),
    ],
)
def test_broken_data_is_refused_in_one_line(field, value):
    env = make()
    (condition,) = env.unwrapped._conditions
    role = {"start": [1.0, 1.0], "yields": True, "group": 0, "stops": [], field: value}
    object.__setattr__(condition, "draw", lambda task, rng: {"people": [role]})
    with pytest.raises(OptionError) as error:
        begin(env)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "options",
    [
        {"density": 3.0},
        {"density": -1.0},
        {"yielding": 1.5},
        {"speed": 0.0},
        {"group": 0},
        {"model": "flock"},
        {"group": 1.5},
    ],
)
def test_wrong_options_are_refused(options):
    with pytest.raises(LabgymError):
        People(**options)


# The social-force model


def test_a_lone_person_takes_up_the_preferred_velocity_with_the_relaxation_time():
    force, disc, preferred, no_wall = (
        SocialForce(0.3, dt=0.001),
        np.zeros((1, 4)),
        np.array([[1.0, 0.0]]),
        [[np.inf] * 2],
    )
    for _ in range(500):
        disc[:, 2:] = pushed(disc, preferred, np.array([False]), np.zeros(4), np.array(no_wall), 2.0, force)
    assert disc[0, 2] == pytest.approx(1.0 - math.exp(-1.0), abs=1e-3)


def test_the_interaction_of_two_people_is_the_published_formula():
    """Head on at rest relative to each other: D = e, so B = gamma and the angle is 0."""
    force = SocialForce(0.3)
    fx, fy = interaction(np.array([0.0, 0.0, 0.5, 0.0]), np.array([1.0, 0.0, 0.5, 0.0]), force)
    assert (fx, fy) == pytest.approx((-5.1 * math.exp(-1.0 / 0.35), 0.0))
    fx, fy = interaction(np.array([0.0, 0.0, 1.0, 0.0]), np.array([1.0, 0.3, 0.0, 0.0]), force)
    assert fx < 0.0
    assert fy < 0.0  # the other one is on the left: step to the right


@pytest.mark.parametrize(("option", "most"), [("density", 2.0), ("yielding", 1.0), ("speed", 3.0), ("group", MOST)])
def test_the_greatest_options_are_taken_and_no_greater_ones(option, most):
    assert getattr(People(**{option: most}), option) == most
    with pytest.raises(LabgymError, match=option):
        People(**{option: most + 1 if option == "group" else 1.01 * most})
    for model in ("orca", "social_force"):
        assert People(model=model).model == model


def test_people_without_arguments_are_as_documented():
    assert People() == People(density=0.125, group=1, yielding=0.5, speed=1.0, model="orca", name="people")
