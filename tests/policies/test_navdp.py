from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
import torch
from diffusers.schedulers.scheduling_ddpm import DDPMScheduler
from scipy.interpolate import RegularGridInterpolator

from labgym.artefacts import artefacts
from labgym.cli import main
from labgym.documents import read_json, write_json
from labgym.errors import DocumentError, OptionError
from labgym.eval.evaluator import evaluate
from labgym.layouts import load_published
from labgym.policies import EpisodeStart, make_policy
from labgym.policies.data import DataOptions, make_dataset
from labgym.policies.data.maps import privileged_maps
from labgym.policies.learned.map_stack import rotated, to_world
from labgym.policies.navdp.config import (
    DiffusionOptions,
    NavDPConfig,
    NavDPLossOptions,
    NavDPNetworkOptions,
    NavDPTrainOptions,
)
from labgym.policies.navdp.diffusion import (
    MIRROR_STEP,
    DrawnTrajectories,
    denoising,
    first_part,
    make_schedule,
    noised,
    points_of,
    sample_steps,
    steps_of,
)
from labgym.policies.navdp.network import NavDPNetwork, frame, load_navdp, save_navdp
from labgym.policies.navdp.policy import NavDPPolicy
from labgym.policies.navdp.train import NavDPSamples, distance_maps, memory_of, path_value, train
from labgym.suites import Suite

SMALL = NavDPNetworkOptions(memory=2, channels=(8, 8, 16), queries=4, width=16, heads=2, layers=2)
CONFIG = NavDPConfig(network=SMALL, training=NavDPTrainOptions(epochs=2, batch=8, warmup=2, held_out=0.3))


@pytest.fixture(scope="module")
def network() -> NavDPNetwork:
    torch.manual_seed(0)
    return NavDPNetwork(CONFIG).eval()


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data")
    make_dataset(folder, DataOptions(samples=24, seed=2, shard=24, layout=8, drive=6), progress=False)
    return folder


@pytest.fixture(scope="module")
def run(data: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("run")
    train(data, folder, CONFIG, progress=False)
    return folder


def tokens_of(network: NavDPNetwork, batch: int = 3) -> torch.Tensor:
    frames = torch.randint(0, 256, (batch, 2, 36, 64, 4), dtype=torch.uint8, generator=torch.Generator().manual_seed(1))
    with torch.no_grad():
        return network.encode(frames)


# Paths and steps


def test_steps_sum_to_the_path_and_are_within_the_bounds_of_the_noise() -> None:
    angle = torch.linspace(0.0, 2.0, 25)
    path = torch.stack([torch.sin(angle), 1.0 - torch.cos(angle)], dim=1)[None] * 1.5
    steps = steps_of(path, 4.0)
    assert steps.abs().max() <= 1.0
    torch.testing.assert_close(points_of(steps, 4.0), path[:, 1:], atol=1e-5, rtol=0.0)
    # On a circle the heading grows as fast as the angle.
    heading = steps[0, :, 2].cumsum(0) / 4.0
    torch.testing.assert_close(heading[-1], torch.tensor(2.0 - 1.0 / 24), atol=1e-3, rtol=0.0)


def test_the_heading_turns_backwards_as_fast_as_the_bound_allows() -> None:
    path = torch.tensor([[[0.0, 0.0], [-0.1, 0.01], [-0.2, 0.02], [-0.3, 0.03]]])
    assert steps_of(path, 4.0)[0, :, 2].tolist() == [1.0, 1.0, 1.0]


def test_a_label_ends_at_the_horizon_or_at_the_goal() -> None:
    straight = torch.linspace(0.0, 1.0, 64)[:, None] * torch.tensor([6.0, 0.0])
    short = torch.linspace(0.0, 1.0, 64)[:, None] * torch.tensor([0.0, 2.0])
    label = first_part(torch.stack([straight, short]), torch.tensor([6.0, 2.0]), 3.6, 24)
    torch.testing.assert_close(label[:, -1], torch.tensor([[3.6, 0.0], [0.0, 2.0]]), atol=1e-5, rtol=0.0)
    torch.testing.assert_close(label[0, 1], torch.tensor([0.15, 0.0]), atol=1e-5, rtol=0.0)


def test_mirrored_steps_are_the_steps_of_the_mirrored_path() -> None:
    path = torch.randn(4, 25, 2, generator=torch.Generator().manual_seed(3)).mul(0.1).cumsum(1)
    path = path - path[:, :1]
    mirrored = steps_of(path * torch.tensor([1.0, -1.0]), 4.0)
    torch.testing.assert_close(mirrored, steps_of(path, 4.0) * MIRROR_STEP, atol=1e-5, rtol=0.0)


def test_a_turned_path_keeps_its_shape() -> None:
    path = torch.tensor([[[1.0, 0.0], [2.0, 0.0]]])
    path_turned = rotated(path, torch.tensor([math.pi / 2.0]))
    torch.testing.assert_close(path_turned, torch.tensor([[[0.0, 1.0], [0.0, 2.0]]]), atol=1e-6, rtol=0.0)


# What paths are worth


def test_values_are_the_published_formula_on_the_true_map() -> None:
    layout = load_published("val", "val-alk_01")
    maps = privileged_maps(layout)
    rows, columns = maps.distance.shape
    centres = [maps.origin[k] + maps.resolution * (np.arange(n) + 0.5) for k, n in ((1, rows), (0, columns))]
    lookup = RegularGridInterpolator(centres, maps.distance, bounds_error=False, fill_value=0.0)
    rng = np.random.default_rng(0)
    pose = np.column_stack([rng.uniform(1.0, 7.0, (6, 2)), rng.uniform(-3.0, 3.0, 6)])
    path = rng.uniform(-1.0, 1.0, (6, 25, 2)).cumsum(axis=1) * 0.1
    options = NavDPLossOptions()
    there = to_world(torch.tensor(path, dtype=torch.float32), torch.tensor(pose, dtype=torch.float32))
    value = path_value(distance_maps([maps]).at(there, torch.zeros(6, dtype=torch.long)), options)
    for k in range(6):
        c, s = math.cos(pose[k, 2]), math.sin(pose[k, 2])
        points = path[k] @ np.array([[c, s], [-s, c]]) + pose[k, :2]
        distance = lookup(points[:, ::-1])
        worth = -5.0 * np.mean(distance < 0.30) + 0.5 * np.sum(np.diff(distance))
        assert float(value[k]) == pytest.approx(worth, abs=0.21)
        assert float(path_value(torch.tensor(distance)[None], options)) == pytest.approx(worth, abs=1e-5)


# The network


def test_the_noise_depends_on_the_goal_only_if_the_goal_is_shown(network: NavDPNetwork) -> None:
    tokens, noisy, time = tokens_of(network), torch.randn(3, 24, 3), torch.tensor([0, 4, 9])
    goals = torch.tensor([[3.0, 1.0]] * 3), torch.tensor([[-2.0, 5.0]] * 3)
    with torch.no_grad():
        hidden = [network.noise(tokens, noisy, time, goal, torch.zeros(3, dtype=torch.bool)) for goal in goals]
        shown = [network.noise(tokens, noisy, time, goal, torch.ones(3, dtype=torch.bool)) for goal in goals]
    torch.testing.assert_close(hidden[0], hidden[1], atol=1e-6, rtol=0.0)
    assert (shown[0] - shown[1]).abs().max() > 1e-4


def test_the_denoiser_is_causal_and_the_critic_is_not(network: NavDPNetwork) -> None:
    tokens, noisy = tokens_of(network), torch.randn(3, 24, 3)
    changed = noisy.clone()
    changed[:, 12:] += 1.0
    with_goal, goal, time = torch.ones(3, dtype=torch.bool), torch.ones(3, 2), torch.zeros(3, dtype=torch.long)
    with torch.no_grad():
        before, after = (network.noise(tokens, each, time, goal, with_goal) for each in (noisy, changed))
        assert (network.value(tokens, noisy) - network.value(tokens, changed)).abs().min() > 1e-6
    torch.testing.assert_close(before[:, :12], after[:, :12], atol=1e-5, rtol=0.0)
    assert (before[:, 12:] - after[:, 12:]).abs().max() > 1e-4


def test_the_schedule_is_the_published_one_and_mixes_noise_by_its_formula() -> None:
    schedule = make_schedule(DiffusionOptions())
    assert isinstance(schedule, DDPMScheduler)
    signal = [math.cos((k / 10 + 0.008) / 1.008 * math.pi / 2.0) ** 2 for k in range(11)]
    betas = [min(1.0 - later / earlier, 0.999) for earlier, later in itertools.pairwise(signal)]
    np.testing.assert_allclose(schedule.betas, betas, rtol=1e-4)
    clean = torch.rand(5, 24, 3) * 2.0 - 1.0
    noise = torch.randn(clean.shape)
    time = torch.tensor([0, 2, 4, 6, 9])
    share = torch.tensor(np.cumprod(1.0 - np.array(betas)), dtype=torch.float32)[time][:, None, None]
    mixed = noised(schedule, clean, noise, time)
    torch.testing.assert_close(mixed, share.sqrt() * clean + (1.0 - share).sqrt() * noise, atol=1e-4, rtol=1e-3)


def test_a_denoising_step_is_that_of_diffusers() -> None:
    schedule = make_schedule(DiffusionOptions())
    schedule.set_timesteps(DiffusionOptions().steps)
    steps = list(denoising(schedule))
    assert [step.time for step in steps] == schedule.timesteps.tolist()
    noisy, predicted = torch.randn(4, 24, 3), torch.randn(4, 24, 3)
    for step in steps:
        expected = schedule.step(predicted, step.time, noisy, generator=torch.Generator().manual_seed(3)).prev_sample
        drawn = torch.randn(noisy.shape, generator=torch.Generator().manual_seed(3))
        clean = ((noisy - step.noise * predicted) / step.signal).clamp(-1.0, 1.0)
        result = step.clean * clean + step.noisy * noisy + step.spread * drawn
        torch.testing.assert_close(result, expected, atol=1e-5, rtol=1e-4)


def test_samples_depend_on_the_generator_alone_and_are_bounded(network: NavDPNetwork) -> None:
    schedule, tokens, goal = make_schedule(CONFIG.diffusion), tokens_of(network, 1), torch.tensor([2.0, 0.0])
    drawn = [
        sample_steps(network, schedule, tokens, goal, 4, torch.Generator().manual_seed(seed)) for seed in (1, 1, 2)
    ]
    assert torch.equal(drawn[0], drawn[1])
    assert not torch.equal(drawn[0], drawn[2])
    assert drawn[0].shape == (4, 24, 3)
    assert drawn[0].abs().max() <= 1.0 + 1e-6


# Frames and memory


def test_depths_that_are_too_near_or_too_far_become_zero() -> None:
    depth = np.full((72, 128), 2.5, np.float32)
    depth[:36, :64], depth[36:, :64] = 7.0, 0.05
    coded = frame(np.zeros((72, 128, 3), np.uint8), depth)
    assert coded.shape == (36, 64, 4)
    assert coded[:, :31, 3].max() == 0
    assert set(coded[:, 33:, 3].ravel().tolist()) == {128}


def test_the_memory_holds_earlier_frames_of_the_same_drive() -> None:
    indices = memory_of(np.array([0, 0, 0, 3, 3, 5]), 3)
    assert indices.tolist() == [[0, 0, 0], [0, 0, 1], [0, 1, 2], [3, 3, 3], [3, 3, 4], [5, 5, 5]]


def test_samples_see_their_own_frame_last(data: Path) -> None:
    samples, dataset = NavDPSamples.read(data, CONFIG)
    assert len(samples.frames) == len(dataset) == 24
    shown = samples.remembered(torch.arange(24), torch.zeros(24, dtype=torch.bool))
    assert torch.equal(shown[:, -1], samples.frames)
    flipped = samples.remembered(torch.arange(24), torch.ones(24, dtype=torch.bool))
    assert torch.equal(flipped.flip(3), shown)


# Training


def test_training_is_deterministic_and_restarts_after_a_lost_checkpoint(data: Path, run: Path, tmp_path: Path) -> None:
    train(data, tmp_path / "again", CONFIG, progress=False)
    weights = [(folder / "weights.safetensors").read_bytes() for folder in (run, tmp_path / "again")]
    assert weights[0] == weights[1]

    stop = tmp_path / "stopped"
    calls = []

    def interrupted(*arguments: object) -> None:
        calls.append(arguments)
        if len(calls) == 2:
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("labgym.policies.navdp.train.save_navdp", interrupted)
        with pytest.raises(KeyboardInterrupt):
            train(data, stop, CONFIG, progress=False)
    (stop / "checkpoint.pt").unlink()
    train(data, stop, CONFIG, progress=False)
    assert (stop / "weights.safetensors").read_bytes() == weights[0]


def test_training_resumes_from_its_checkpoint(data: Path, run: Path, tmp_path: Path) -> None:
    once = tmp_path / "once"
    real = save_navdp

    def stops(folder: Path, network: NavDPNetwork, config: NavDPConfig) -> None:
        real(folder, network, config)
        if (folder / "history.jsonl").exists():
            raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("labgym.policies.navdp.train.save_navdp", stops)
        with pytest.raises(KeyboardInterrupt):
            train(data, once, CONFIG, progress=False)
    assert len((once / "history.jsonl").read_text().splitlines()) == 1
    train(data, once, CONFIG, progress=False)
    assert len((once / "history.jsonl").read_text().splitlines()) == 2
    assert (once / "weights.safetensors").read_bytes() == (run / "weights.safetensors").read_bytes()


def test_a_run_of_another_configuration_is_left_alone(data: Path, run: Path) -> None:
    with pytest.raises(OptionError, match=r"epochs \(2 there, 12 requested\)"):
        train(data, run, NavDPConfig(network=SMALL), progress=False)


def test_the_command_trains(data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["train", "navdp", "--data", str(data), "--out", str(tmp_path), "--epochs", "0"]) == 2
    monkeypatch.setattr(
        "labgym.policies.navdp.train.train",
        lambda data, out, config, fresh, start: (out / "done").write_text(f"{config} {fresh} {start}"),
    )
    arguments = ["--epochs", "3", "--memory", "5", "--shrink", "1", "--start", "other"]
    assert main(["train", "navdp", "--data", str(data), "--out", str(tmp_path), *arguments]) == 0
    for part in ("epochs=3", "memory=5", "shrink=1", "channels=(8, 16, 40, 80)", "other"):
        assert part in (tmp_path / "done").read_text()


# The policy


def policy_in(run: Path, **options: object) -> NavDPPolicy:
    policy = NavDPPolicy(run, {"samples": 3, **options})
    policy.reset(EpisodeStart(goal=(3.0, 0.0), rng=np.random.default_rng(0)))
    return policy


def looking(bearing: float = 0.0, x: float = 0.0, speed: float = 0.0) -> dict[str, np.ndarray]:
    return {
        "goal": np.array([3.0, math.cos(bearing), math.sin(bearing)], np.float32),
        "velocity": np.array([speed, 0.0], np.float32),
        "odometry": np.array([x, 0.0, 0.0]),
        "depth": np.full(9216, 3.0, np.float32),
        "rgb": np.full((72, 128, 3), 90, np.uint8),
    }


def paths(*ends: tuple[float, float]) -> np.ndarray:
    return np.array([np.linspace(0.0, 1.0, 24)[:, None] * np.array(end) for end in ends])


def test_it_turns_to_the_goal_before_it_draws(run: Path) -> None:
    policy = policy_in(run)
    forward, turn = policy.act(looking(bearing=2.0))
    assert (forward, np.sign(turn)) == (0.0, 1.0)
    assert policy.planned_path() is None


def test_without_a_goal_it_draws_trajectories_to_anywhere(run: Path, network: NavDPNetwork) -> None:
    policy = policy_in(run, stop=None, shortest=0.0)
    policy.reset(EpisodeStart(goal=(0.0, 0.0), rng=np.random.default_rng(0), goal_kind="none"))
    view = looking()
    del view["goal"]
    assert np.isfinite(policy.act(view)).all()
    assert policy.planned_path() is not None
    schedule, tokens = make_schedule(CONFIG.diffusion), tokens_of(network, 1)
    free, bound = (
        sample_steps(network, schedule, tokens, goal, 4, torch.Generator().manual_seed(1))
        for goal in (None, torch.tensor([2.0, 0.0]))
    )
    assert free.shape == bound.shape
    assert not torch.equal(free, bound)


def test_it_follows_the_trajectory_with_the_highest_value_unless_it_means_stop(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    policy = policy_in(run)
    drawn = DrawnTrajectories(paths((0.0, 0.0), (2.0, 0.0), (2.0, 1.0)), np.array([1.0, -0.5, -0.2]))
    monkeypatch.setattr(policy, "draw", lambda *_: drawn)
    policy.act(looking())
    np.testing.assert_allclose(policy.planned_path()[-1], [2.0, 1.0], atol=1e-9)
    first = policy_in(run, choose="first")
    monkeypatch.setattr(first, "draw", lambda *_: drawn)
    first.act(looking())
    np.testing.assert_allclose(first.planned_path()[-1], [2.0, 0.0], atol=1e-9)


def test_it_turns_in_place_if_no_trajectory_is_safe(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    policy = policy_in(run, stop=-1.0)
    monkeypatch.setattr(policy, "draw", lambda *_: DrawnTrajectories(paths((2.0, 0.0)), np.array([-3.0])))
    forward, turn = policy.act(looking())
    assert forward == 0.0
    assert abs(turn) > 0.0
    assert policy.planned_path() is None


def test_it_draws_again_after_the_distance_that_it_commits_to(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    policy = policy_in(run, commit=0.4)
    calls = []
    monkeypatch.setattr(
        policy, "draw", lambda goal, _: calls.append(goal) or DrawnTrajectories(paths((3.0, 0.0)), np.array([0.0]))
    )
    for step in range(10):
        policy.act(looking(x=0.1 * step, speed=1.0))
    assert len(calls) == 3


def test_equal_seeds_draw_equal_trajectories(run: Path) -> None:
    rgb, depth = np.full((72, 128, 3), 90, np.uint8), np.full((72, 128), 3.0, np.float32)
    policy = policy_in(run)
    drawn = [policy.drawn_from(rgb, depth, (3.0, 0.0), seed) for seed in (4, 4, 5)]
    np.testing.assert_array_equal(drawn[0].trajectories, drawn[1].trajectories)
    assert not np.array_equal(drawn[0].trajectories, drawn[2].trajectories)
    ends = np.linalg.norm(drawn[0].trajectories[:, -1], axis=1)
    assert ((ends == 0.0) | (ends >= 0.5)).all()


def test_trajectories_are_drawn_for_goals_of_any_float_type(run: Path) -> None:
    rgb, depth = np.full((72, 128, 3), 90, np.uint8), np.full((72, 128), 3.0, np.float32)
    policy = policy_in(run)
    goals = [(3.0, 0.5), tuple(np.array([3.0, 0.5])), np.array([3.0, 0.5], np.float32)]
    drawn = [policy.drawn_from(rgb, depth, goal, seed=1).trajectories for goal in goals]
    np.testing.assert_array_equal(drawn[0], drawn[1])
    np.testing.assert_array_equal(drawn[0], drawn[2])


@pytest.mark.parametrize("changes, named", [({"heads": 5}, "heads 5"), ({"channels": (8, 12, 16)}, "channels 12")])
def test_a_network_that_cannot_be_built_is_refused_with_the_reason(
    run: Path, tmp_path: Path, changes: dict[str, object], named: str
) -> None:
    document = read_json(run / "config.json")
    document["network"] |= changes
    write_json(tmp_path / "config.json", document)
    with pytest.raises(DocumentError, match=named):
        load_navdp(tmp_path)


def test_broken_weights_are_refused(run: Path, tmp_path: Path) -> None:
    (tmp_path / "config.json").write_bytes((run / "config.json").read_bytes())
    (tmp_path / "weights.safetensors").write_bytes(b"\x80\x04 no tensors")
    with pytest.raises(DocumentError, match="weights"):
        load_navdp(tmp_path)
    with pytest.raises(DocumentError):
        NavDPPolicy(tmp_path / "nowhere")


def test_the_published_policy_drives_and_names_its_weights() -> None:
    policy = make_policy("navdp")
    folder = artefacts("policies") / "navdp"
    assert set(policy.files()) == {folder / "config.json", folder / "weights.safetensors"}
    assert all(path.stat().st_size < 8_000_000 for path in policy.files())
    short = Suite(name="short", split="val", max_steps=4).first([load_published("val", "val-alk_01")], 3)
    reports = [evaluate(policy, short, progress=False) for _ in range(2)]
    assert [row.error for row in reports[0].rows] == [None] * len(reports[0].rows)
    assert reports[0].routes == reports[1].routes
