from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch
from scipy.interpolate import CubicHermiteSpline
from scipy.ndimage import map_coordinates

from labgym.artefacts import artefacts
from labgym.documents import read_json, write_json
from labgym.envs.sensors import IMAGE_SHAPE
from labgym.errors import DocumentError, OptionError
from labgym.navigation import OccupancyGrid
from labgym.policies import EpisodeStart, make_policy
from labgym.policies.data import Dataset
from labgym.policies.data.maps import Maps, cost_map
from labgym.policies.grid_planner import clearance_field
from labgym.policies.iplanner import train as training
from labgym.policies.iplanner.config import (
    IPlannerConfig,
    IPlannerLossOptions,
    IPlannerNetworkOptions,
    IPlannerTrainOptions,
)
from labgym.policies.iplanner.cost_to_go import CostToGoTargets, PointTargets, targets_of
from labgym.policies.iplanner.network import IPlannerNetwork, load_iplanner, path_through, path_weights, save_iplanner
from labgym.policies.iplanner.policy import IPlannerOptions, IPlannerPolicy
from labgym.policies.iplanner.train import cost_maps, planning_loss
from labgym.policies.learned import training_loop
from labgym.policies.learned.map_stack import to_world

SMALL = IPlannerNetworkOptions(channels=(4, 8), goal_width=4)
STILL = (0.0, 0.0)


def room_with_a_block() -> Maps:
    """Five metres square, with a blocked square of a metre in the middle."""
    blocked = np.zeros((100, 100), dtype=bool)
    blocked[40:60, 40:60] = True
    return Maps(cost_map(blocked), clearance_field(OccupancyGrid(blocked)).astype(np.float32), (0.0, 0.0), 0.05)


def empty_room() -> Maps:
    """Five metres square, free everywhere."""
    return Maps(np.zeros((100, 100), np.float32), np.full((100, 100), 9.0, np.float32), (0.0, 0.0), 0.05)


def world_goals(data: Dataset) -> np.ndarray:
    """The goals of a dataset's samples in the room frame, (n, 2)."""
    cosine, sine, (x, y) = np.cos(data.pose[:, 2]), np.sin(data.pose[:, 2]), data.goal.T
    return data.pose[:, :2] + np.column_stack([cosine * x - sine * y, sine * x + cosine * y])


def toy_dataset(count: int = 64) -> Dataset:
    """Robots that look at blank images with goals around them; nothing is in the way but the block."""
    rng = np.random.default_rng(0)
    goal = rng.uniform(-1.5, 1.5, (count, 2)).astype(np.float32)
    return Dataset(
        depth=rng.integers(500, 9000, (count, *IMAGE_SHAPE)).astype(np.uint16),
        pose=np.column_stack([rng.uniform(0.5, 4.5, (count, 2)), rng.uniform(-3, 3, count)]).astype(np.float32),
        goal=goal,
        path=np.linspace(0.0, 1.0, 64, dtype=np.float32)[None, :, None] * goal[:, None],
        length=np.linalg.norm(goal, axis=1).astype(np.float32),
        place=(np.arange(count) // (count // 2)).astype(np.int64),
        drive=np.arange(count),
        maps=(room_with_a_block(), room_with_a_block()),
    )


@pytest.fixture
def toy(monkeypatch: pytest.MonkeyPatch) -> Dataset:
    data = toy_dataset()
    monkeypatch.setattr(training, "load_dataset", lambda folder, samples=None: data)
    monkeypatch.setattr(training_loop, "load_manifest", lambda folder: SimpleNamespace(digest=str(folder)))
    return data


def config(epochs: int = 3, target: str = "expert") -> IPlannerConfig:
    loss = IPlannerLossOptions.model_validate({"target": target})
    return IPlannerConfig(
        network=SMALL, loss=loss, training=IPlannerTrainOptions(epochs=epochs, batch=8, held_out=0.5, rate=3e-3)
    )


def test_the_path_begins_at_the_robot_and_goes_through_its_key_points() -> None:
    points = torch.randn(3, 5, 2, generator=torch.Generator().manual_seed(1))
    path = path_through(points, path_weights(6, 51))
    assert path.shape == (3, 51, 2)
    torch.testing.assert_close(path[:, ::10], torch.cat([torch.zeros(3, 1, 2), points], dim=1))


def test_the_path_is_scipys_cubic_hermite_spline() -> None:
    knots = np.random.default_rng(2).normal(size=(6, 2))
    knots[0] = 0.0
    slopes = np.gradient(knots, axis=0)
    expected = CubicHermiteSpline(np.arange(6), knots, slopes)(np.linspace(0, 5, 51))
    path = path_through(torch.from_numpy(knots[None, 1:]).float(), path_weights(6, 51))
    np.testing.assert_allclose(path[0].numpy(), expected, atol=1e-5)


def test_even_key_points_on_a_line_give_an_even_line() -> None:
    points = torch.arange(1.0, 6.0)[None, :, None] * torch.tensor([0.5, -0.2])
    path = path_through(points, path_weights(6, 51))[0]
    torch.testing.assert_close(path, torch.linspace(0, 5, 51)[:, None] * torch.tensor([0.5, -0.2]))


def test_costs_are_read_at_the_right_place_of_the_right_map() -> None:
    ramp = np.broadcast_to(np.arange(80, dtype=np.float32) * 0.05 + 0.025, (60, 80)).copy()
    along_x = Maps(ramp, ramp, (-1.0, -1.0), 0.05)
    along_y = Maps(ramp[:, :60].T.copy(), ramp, (0.0, 0.0), 0.05)
    points = torch.tensor([[[0.3, 0.5], [2.0, 1.0]], [[0.6, 0.4], [0.9, 1.7]]])
    # The maps' values are the distance from their origin, and a cubic kernel leaves a ramp as it is.
    expected = torch.tensor([[1.3, 3.0], [0.4, 1.7]])
    torch.testing.assert_close(cost_maps([along_x, along_y]).at(points, torch.tensor([0, 1])), expected)


def test_costs_between_cells_are_near_those_of_a_spline_through_them() -> None:
    maps = room_with_a_block()
    points = np.random.default_rng(3).uniform(0.5, 4.5, (50, 2))
    costs = cost_maps([maps]).at(torch.from_numpy(points[None]).float(), torch.tensor([0]))[0]
    cells = (points[:, ::-1] / 0.05 - 0.5).T
    np.testing.assert_allclose(costs.numpy(), map_coordinates(maps.cost, cells, order=3), atol=0.03)


def test_loss_terms_agree_with_a_calculation_by_hand() -> None:
    # Three points, a metre and two metres apart; the way is 4 m and misses its target by 1 m: even steps would be 2 m.
    path = torch.tensor([[[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]]])
    costs = torch.tensor([[0.1, 0.2, 0.7]])
    losses = planning_loss(path, costs, torch.tensor([1.0]), torch.tensor([4.0]), IPlannerLossOptions())
    assert float(losses.obstacle) == pytest.approx(1.0)
    assert float(losses.motion) == pytest.approx(1.0)
    assert float(losses.goal) == pytest.approx(math.log(2.0))
    assert float(losses.total) == pytest.approx(0.5 * 1.0 + 2.0 * 1.0 + 5.0 * math.log(2.0))


def test_the_gradient_moves_a_path_out_of_an_obstacle() -> None:
    maps, options = cost_maps([room_with_a_block()]), IPlannerLossOptions()
    pose, target = torch.tensor([[1.0, 2.4, 0.0]]), torch.tensor([[3.0, 0.0]])
    points = (torch.linspace(0.2, 1.0, 5)[None, :, None] * target[:, None]).requires_grad_()
    optimiser = torch.optim.Adam([points], lr=0.02)
    weights = path_weights(6, 51)

    def costs() -> torch.Tensor:
        return maps.at(to_world(path_through(points, weights), pose), torch.tensor([0]))

    assert costs().max().item() > 1.0
    for _ in range(200):
        optimiser.zero_grad()
        path = path_through(points, weights)
        miss = (target - path[:, -1]).norm(dim=1)
        planning_loss(path, costs(), miss, torch.tensor([3.0]), options).total.backward()
        optimiser.step()
    assert costs().max().item() < 0.5
    assert (path_through(points, weights)[0, -1] - target[0]).norm().item() < 0.1


def test_expert_targets_lie_a_horizon_along_the_expert_path_or_at_the_goal() -> None:
    bent = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], np.float32)
    data = replace(
        toy_dataset(4), path=np.stack([bent] * 4), length=np.full(4, 2.0, np.float32), goal=np.stack([bent[-1]] * 4)
    )
    for horizon, point, along, straight in [
        (1.5, [1.0, 0.5], 1.5, math.hypot(1.0, 0.5)),
        (9.0, [1.0, 1.0], 2.0, math.sqrt(2.0)),
    ]:
        options = IPlannerLossOptions(target="expert", horizon=horizon)
        chosen, ends = torch.arange(4), torch.tensor([point] * 4)
        targets = targets_of(data, options)
        np.testing.assert_allclose(targets.miss(chosen, ends, ends), np.zeros(4), atol=1e-6)
        np.testing.assert_allclose(targets.miss(chosen, ends + torch.tensor([0.3, 0.4]), ends), np.full(4, 0.5), 1e-5)
        np.testing.assert_allclose(targets.reach, [along] * 4)
        np.testing.assert_allclose(targets_of(data, options.model_copy(update={"along": False})).reach, [straight] * 4)


def test_the_published_target_is_the_goal_with_even_steps_along_the_straight_line() -> None:
    data = toy_dataset(4)
    targets = targets_of(data, IPlannerLossOptions(target="goal", horizon=0.1))
    assert isinstance(targets, PointTargets)
    goal = torch.from_numpy(data.goal)
    assert torch.equal(targets.miss(torch.arange(4), goal, goal), torch.zeros(4))
    np.testing.assert_allclose(targets.reach, np.linalg.norm(data.goal, axis=1), 1e-6)


def test_cost_to_go_targets_are_reached_after_a_horizon_on_the_straight_line_in_an_empty_room() -> None:
    data = replace(toy_dataset(32), maps=(empty_room(), empty_room()))
    length = np.linalg.norm(data.goal, axis=1)
    targets = targets_of(data, IPlannerLossOptions(target="cost-to-go", horizon=1.0))
    assert isinstance(targets, CostToGoTargets)
    np.testing.assert_allclose(targets.reach, np.minimum(length, 1.0), atol=0.06)
    inside = (np.abs(world_goals(data) - 2.5) < 2.0).all(axis=1)
    chosen = torch.from_numpy(np.flatnonzero(inside))
    share = torch.from_numpy((np.minimum(length, 1.0) / length).astype(np.float32))
    local = (share[:, None] * torch.from_numpy(data.goal))[chosen]
    world = to_world(local[:, None], torch.from_numpy(data.pose)[chosen])[:, 0]
    assert len(chosen) > 16
    assert targets.miss(chosen, local, world).max() < 0.06
    # The robot's own place misses by the horizon, and the goal itself by all that lies beyond the horizon.
    here = torch.from_numpy(data.pose[:, :2])[chosen]
    np.testing.assert_allclose(targets.miss(chosen, local, here), np.minimum(length, 1.0)[chosen], atol=0.06)


def test_straight_steps_do_not_change_where_the_cost_to_go_should_be() -> None:
    data = toy_dataset(8)
    options = IPlannerLossOptions(target="cost-to-go", horizon=0.5)
    along, straight = (targets_of(data, options.model_copy(update={"along": value})) for value in (True, False))
    here = torch.from_numpy(data.pose[:, :2])
    assert torch.equal(along.miss(torch.arange(8), here, here), straight.miss(torch.arange(8), here, here))
    np.testing.assert_allclose(straight.reach, np.minimum(np.linalg.norm(data.goal, axis=1), 0.5), 1e-6)


@pytest.mark.parametrize("target", ["expert", "cost-to-go"])
def test_thirty_steps_of_training_lower_the_loss(toy: Dataset, tmp_path: Path, target: str) -> None:
    training.train("data", tmp_path, config(8, target), progress=False)
    rows = [float(line.split('"total": ')[1].split(",")[0]) for line in (tmp_path / "history.jsonl").open()]
    assert len(rows) == 8
    assert rows[-1] < 0.8 * rows[0]


def test_a_resumed_run_ends_with_the_weights_of_an_uninterrupted_one(
    toy: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = training.train("data", tmp_path / "whole", config(), progress=False)
    save = training_loop.save_checkpoint

    def stop_after_two(path: Path, parts: object, history: list[object]) -> None:
        save(path, parts, history)
        if len(history) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(training_loop, "save_checkpoint", stop_after_two)
    with pytest.raises(KeyboardInterrupt):
        training.train("data", tmp_path / "parts", config(), progress=False)
    monkeypatch.setattr(training_loop, "save_checkpoint", save)
    resumed = training.train("data", tmp_path / "parts", config(), progress=False)
    for name, value in whole.state_dict().items():
        assert torch.equal(value, resumed.state_dict()[name]), name
    for name in ("weights.safetensors", "history.jsonl", "config.json"):
        assert (tmp_path / "whole" / name).read_bytes() == (tmp_path / "parts" / name).read_bytes()


def test_a_folder_keeps_to_one_configuration(toy: Dataset, tmp_path: Path) -> None:
    training.train("data", tmp_path, config(1), progress=False)
    with pytest.raises(OptionError, match=r"epochs \(1 there, 2 requested\).*--fresh"):
        training.train("data", tmp_path, config(2), progress=False)
    with pytest.raises(OptionError, match="dataset"):
        training.train("other data", tmp_path, config(1), progress=False)


def test_a_finished_run_is_not_trained_again_and_its_weights_are_checked(
    toy: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    network = training.train("data", tmp_path, config(1), progress=False)
    assert not (tmp_path / "checkpoint.pt").exists()
    with monkeypatch.context() as patch:
        patch.setattr(training, "run_epochs", None)
        again = training.train("data", tmp_path, config(1), progress=False)
    assert all(torch.equal(value, again.state_dict()[name]) for name, value in network.state_dict().items())
    (tmp_path / "history.jsonl").write_text("")
    with pytest.raises(DocumentError, match=r"history\.jsonl.*was changed"):
        training.train("data", tmp_path, config(1), progress=False)


def test_a_fresh_run_moves_the_old_one_aside(toy: Dataset, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    training.train("data", folder, config(1), progress=False)
    old = (folder / "weights.safetensors").read_bytes()
    training.train("data", folder, config(2), progress=False, fresh=True)
    assert (tmp_path / "run.old-1/weights.safetensors").read_bytes() == old


def saved(folder: Path) -> Path:
    torch.manual_seed(0)
    save_iplanner(folder, IPlannerNetwork(SMALL), IPlannerConfig(network=SMALL))
    return folder


def test_weights_come_back_from_their_files(tmp_path: Path) -> None:
    folder = saved(tmp_path)
    torch.manual_seed(0)
    before, after = IPlannerNetwork(SMALL).eval(), load_iplanner(folder)
    depth, goal = torch.rand(2, *IMAGE_SHAPE) * 9.0, torch.tensor([[1.0, 2.0], [3.0, -1.0]])
    with torch.no_grad():
        assert torch.equal(before(depth, goal), after(depth, goal))


def test_weights_of_another_network_are_refused(tmp_path: Path) -> None:
    folder = saved(tmp_path)
    document = read_json(folder / "config.json")
    document["network"]["goal_width"] = 5
    write_json(folder / "config.json", document)
    with pytest.raises(DocumentError, match=r"weights\.safetensors"):
        load_iplanner(folder)


def test_depth_out_of_range_counts_as_no_hit() -> None:
    network = IPlannerNetwork(SMALL).eval()
    far, none = torch.full((1, *IMAGE_SHAPE), 10.0), torch.zeros(1, *IMAGE_SHAPE)
    with torch.no_grad():
        assert torch.equal(network(far, torch.tensor([[1.0, 0.0]])), network(none, torch.tensor([[1.0, 0.0]])))


class Scripted(IPlannerPolicy):
    """Plans straight on, in a direction that the test sets; the rest is the policy's own."""

    slope = 0.0

    def plan(self, depth: np.ndarray, goal: tuple[float, float]) -> np.ndarray:
        return np.linspace(0.0, 3.0, 51)[:, None] * (1.0, self.slope)


def observation_of(
    bearing: float, nearest: float = 5.0, pose: tuple[float, float, float] = (0.0, 0.0, 0.0), speed: float = 0.5
) -> dict[str, object]:
    return {
        "goal": np.array([4.0, math.cos(bearing), math.sin(bearing)], np.float32),
        "velocity": np.array([speed, 0.0], np.float32),
        "depth": np.full(IMAGE_SHAPE[0] * IMAGE_SHAPE[1], nearest, np.float32),
        "odometry": np.array(pose),
    }


@pytest.fixture
def policy(tmp_path: Path) -> Scripted:
    scripted = Scripted(saved(tmp_path), IPlannerOptions(look=1))
    scripted.reset(EpisodeStart(goal=(4.0, 0.0), rng=np.random.default_rng(0)))
    return scripted


@pytest.mark.parametrize("bearing", [3.0, -2.0, 0.9])
def test_an_episode_begins_by_turning_to_the_goal(policy: Scripted, bearing: float) -> None:
    forward, turn = policy.act(observation_of(bearing))
    assert forward == 0.0
    assert math.copysign(1.0, turn) == math.copysign(1.0, bearing)
    assert policy.act(observation_of(0.1))[0] > 0.0
    # Later a goal abeam does not stop it: there is something to go around.
    assert policy.act(observation_of(bearing))[0] > 0.0


def test_it_keeps_a_path_until_it_has_followed_it_for_a_while(policy: Scripted) -> None:
    policy.slope = 2.0
    assert policy.act(observation_of(0.0))[1] > 0.0
    policy.slope = -2.0
    assert policy.act(observation_of(0.0, pose=(0.0, 0.0, 0.3)))[1] > 0.0
    assert policy.act(observation_of(0.0, pose=(0.4, 0.6, 0.3)))[1] < 0.0


def test_it_turns_where_it_is_stuck_and_plans_again_after_the_turn(policy: Scripted) -> None:
    forwards = [policy.act(observation_of(0.0))[0] for _ in range(policy._options.stuck_steps)]
    assert forwards[-2] > 0.0
    assert forwards[-1] == 0.0
    assert policy.act(observation_of(0.0, pose=(0.0, 0.0, 0.3)))[0] == 0.0
    assert policy.act(observation_of(0.0, pose=(0.0, 0.0, 0.7)))[0] > 0.0


def test_paths_are_followed_in_the_frame_of_the_episode(policy: Scripted) -> None:
    # Planned at yaw 0.4, straight ahead: at that heading there is nothing to steer.
    forward, turn = policy.act(observation_of(0.0, pose=(1.0, 2.0, 0.4)))
    assert forward > 0.0
    assert abs(turn) < 1e-6


def test_it_backs_off_from_an_unseen_obstacle(policy: Scripted) -> None:
    forwards = [policy.act(observation_of(0.0, speed=0.0))[0] for _ in range(12)]
    assert forwards[0] > 0.0
    assert min(forwards) < 0.0
    assert forwards[-1] > 0.0


def driven_until_it_glances(policy: Scripted) -> tuple[float, float, float]:
    """Drive ahead with the goal abeam, to the left, until the robot stops to look at it; return the pose."""
    for k in range(30):
        pose = (0.1 * k, 0.0, 0.0)
        if policy.act(observation_of(0.0 if k == 0 else 1.4, pose=pose))[0] == 0.0:
            return pose
    raise AssertionError("it never looked")


def test_it_looks_at_a_goal_that_was_out_of_sight_for_a_meter_and_takes_a_path_that_leads_on(policy: Scripted) -> None:
    x, y, _ = driven_until_it_glances(policy)
    assert x == pytest.approx(1.1)
    assert policy.act(observation_of(0.8, pose=(x, y, 0.6)))[1] > 0.0
    # Seen from there the way is straight on, between where it was heading and the goal.
    assert policy.act(observation_of(0.0, pose=(x, y, 1.4)))[0] > 0.0


def test_after_a_look_at_the_goal_it_continues_as_before_if_the_path_leads_back(policy: Scripted) -> None:
    x, y, _ = driven_until_it_glances(policy)
    policy.slope = 2.0
    forward, turn = policy.act(observation_of(0.0, pose=(x, y, 1.4)))
    assert forward == 0.0
    assert turn < 0.0


@pytest.mark.parametrize(
    ("loss", "target"), [({}, "expert"), ({"horizon": 2.0}, "expert"), ({"along": False, "horizon": None}, "goal")]
)
def test_weights_of_version_2_load_and_keep_their_target(tmp_path: Path, loss: dict[str, Any], target: str) -> None:
    folder = saved(tmp_path)
    document = read_json(folder / "config.json")
    write_json(folder / "config.json", {**document, "schema": "labgym.iplanner/2", "loss": loss})
    config = IPlannerConfig.load(folder / "config.json")
    assert (config.loss.target, config.loss.horizon) == (target, loss.get("horizon") or 3.5)
    assert config.loss.along == loss.get("along", True)
    assert config.to_json()["schema"] == "labgym.iplanner/3"
    load_iplanner(folder)


@pytest.mark.parametrize("loss", [{"horizon": -1.0}, {"fear": 1.0}, "heavy", None, [3.5]])
def test_a_broken_loss_of_version_2_is_refused(tmp_path: Path, loss: object) -> None:
    folder = saved(tmp_path)
    document = read_json(folder / "config.json")
    write_json(folder / "config.json", {**document, "schema": "labgym.iplanner/2", "loss": loss})
    with pytest.raises(DocumentError, match="loss"):
        load_iplanner(folder)


def test_results_of_the_published_policy_record_the_hash_of_its_weights() -> None:
    folder = artefacts("policies") / "iplanner"
    assert set(make_policy("iplanner").files()) == {folder / "config.json", folder / "weights.safetensors"}
