"""A saved policy acts as the model of stable-baselines3 does after `VecNormalize`."""

from __future__ import annotations

import json
import math

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from safetensors import safe_open
from stable_baselines3 import A2C, DDPG, PPO, SAC, TD3
from stable_baselines3.common.policies import MultiInputActorCriticPolicy
from stable_baselines3.common.torch_layers import CombinedExtractor
from stable_baselines3.common.vec_env import DummyVecEnv, VecFrameStack, VecNormalize
from torch import nn

from labgym.errors import DocumentError, LabgymError, OptionError
from labgym.policies import EpisodeStart, make_policy
from labgym.training import save_policy
from labgym.training.environments import NearGoal
from labgym.training.export import Rays, RobotFrame

SMALL = {"net_arch": [16, 16]}


def start(goal: tuple[float, float] = (3.0, 0.5)) -> EpisodeStart:
    return EpisodeStart(goal=goal, rng=np.random.default_rng(0))


def environments(blank, space: gym.Space, **normalize) -> VecNormalize | DummyVecEnv:
    made = DummyVecEnv([lambda: blank(space)])
    if not normalize:
        return made
    normalized = VecNormalize(made, **normalize)
    space.seed(3)
    normalized.reset()
    for _ in range(30):
        normalized.step(np.zeros((1, 2), np.float32))
    return normalized


@pytest.mark.parametrize("algorithm", [PPO, SAC, TD3])
@pytest.mark.parametrize("normalize", [{}, {"clip_obs": 1.5}, {"norm_obs_keys": ["lidar"]}])
def test_a_saved_policy_acts_as_its_model(algorithm, normalize, blank, usual_space, observations, tmp_path):
    made = environments(blank, usual_space, **normalize)
    model = algorithm("MultiInputPolicy", made, policy_kwargs=dict(SMALL), seed=1, device="cpu")
    policy = make_policy(str(save_policy(model, tmp_path / "policy.safetensors")))
    assert policy.observation == "lidar"
    policy.reset(start())
    for each in observations:
        inputs = {name: each[name] for name in usual_space}
        expected, _ = model.predict(made.normalize_obs(inputs) if normalize else inputs, deterministic=True)
        np.testing.assert_allclose(policy.act(each), expected, rtol=0.0, atol=2e-6)


def test_a_model_on_flattened_observations_acts_as_before(blank, observations, tmp_path):
    space = gym.spaces.Box(-10.0, 10.0, (185,), np.float32)
    made = environments(blank, space, norm_obs=True)
    model = PPO("MlpPolicy", made, policy_kwargs=dict(SMALL), device="cpu")
    policy = make_policy(str(save_policy(model, tmp_path / "policy.safetensors")))
    for each in observations:
        flat = np.concatenate([each["goal"], each["lidar"], each["velocity"]])
        expected, _ = model.predict(made.normalize_obs(flat), deterministic=True)
        np.testing.assert_allclose(policy.act(each), expected, rtol=0.0, atol=2e-6)


def test_a_goal_policy_gets_its_goal_and_its_pose_in_the_start_frame(blank, observations, tmp_path):
    sizes = {"observation": 186, "achieved_goal": 2, "desired_goal": 2}
    space = gym.spaces.Dict({name: gym.spaces.Box(-50.0, 50.0, (size,), np.float32) for name, size in sizes.items()})
    model = SAC("MultiInputPolicy", environments(blank, space), policy_kwargs=dict(SMALL), device="cpu")
    policy = make_policy(str(save_policy(model, tmp_path / "policy.safetensors")))
    policy.reset(start((2.0, -1.0)))
    for each in observations:
        x, y, yaw = each["odometry"]
        joint = [x, y, math.cos(yaw), math.sin(yaw), *each["velocity"], *each["lidar"]]
        inputs = {"observation": joint, "achieved_goal": [x, y], "desired_goal": [2.0, -1.0]}
        arrays = {name: np.array(value, np.float32) for name, value in inputs.items()}
        expected, _ = model.predict(arrays, deterministic=True)
        np.testing.assert_allclose(policy.act(each), expected, rtol=0.0, atol=2e-6)


@pytest.mark.parametrize("algorithm", [PPO, SAC])
def test_the_goal_up_close_is_computed_as_in_the_training(algorithm, blank, usual_space, observations, tmp_path):
    made = NearGoal(environments(blank, usual_space))
    keys = {"norm_obs_keys": ["goal", "lidar"], "clip_obs": 1.5}
    normalized = VecNormalize(made, **keys)
    normalized.reset()
    model = algorithm("MultiInputPolicy", normalized, policy_kwargs=dict(SMALL), seed=1, device="cpu")
    policy = make_policy(str(save_policy(model, tmp_path / "policy.safetensors")))
    policy.reset(start())
    for each in observations:
        each["goal"] = np.array([abs(each["goal"][0]) / 5.0, *each["goal"][1:] / 10.0], np.float32)
        distance, cosine, sine = (float(value) for value in each["goal"])
        near = [5.0 * min(distance, 1.0) * factor for factor in (1.0, cosine, sine)]
        inputs = {**{name: each[name] for name in usual_space}, "near_goal": np.array(near, np.float32)}
        expected, _ = model.predict(normalized.normalize_obs(inputs), deterministic=True)
        np.testing.assert_allclose(policy.act(each), expected, rtol=0.0, atol=2e-6)


def test_a_policy_in_the_robot_frame_needs_no_pose(blank, observations, tmp_path):
    """The same goal in another start frame gives the same action, which is that of the policy on goal and lidar."""
    sizes = {"observation": 186, "achieved_goal": 2, "desired_goal": 2}
    space = gym.spaces.Dict({name: gym.spaces.Box(-50.0, 50.0, (size,), np.float32) for name, size in sizes.items()})
    options = {**SMALL, "features_extractor_class": RobotFrame}
    model = SAC("MultiInputPolicy", environments(blank, space), policy_kwargs=options, seed=2, device="cpu")
    policy = make_policy(str(save_policy(model, tmp_path / "policy.safetensors")))
    policy.reset(start())
    for each in observations:
        bearing = float(each["odometry"][2])
        each["goal"] = np.array([abs(each["goal"][0]), math.cos(bearing), math.sin(bearing)], np.float32)
        for x, y, yaw in ((0.0, 0.0, 0.0), (1.0, -2.0, 2.5)):
            pose = [x, y, math.cos(yaw), math.sin(yaw)]
            distance, direction = float(each["goal"][0]), yaw + bearing
            inputs = {
                "observation": [*pose, *each["velocity"], *each["lidar"]],
                "achieved_goal": [x, y],
                "desired_goal": [x + distance * math.cos(direction), y + distance * math.sin(direction)],
            }
            arrays = {name: np.array(value, np.float32) for name, value in inputs.items()}
            expected, _ = model.predict(arrays, deterministic=True)
            np.testing.assert_allclose(policy.act(each), expected, rtol=0.0, atol=2e-5)


def test_a_model_that_looks_at_images_is_refused(blank, tmp_path):
    space = gym.spaces.Dict({"rgb": gym.spaces.Box(0, 255, (72, 128, 3), np.uint8)})
    model = PPO("MultiInputPolicy", environments(blank, space), n_steps=2, batch_size=2, device="cpu")
    with pytest.raises(OptionError, match=r"looks at images.*ONNX"):
        save_policy(model, tmp_path / "policy.safetensors")


def test_another_suffix_is_refused(blank, usual_space, tmp_path):
    model = PPO("MultiInputPolicy", environments(blank, usual_space), policy_kwargs=dict(SMALL), device="cpu")
    with pytest.raises(OptionError, match=r"expected the suffix \.safetensors"):
        save_policy(model, tmp_path / "policy.zip")


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 not an actor", b"\x08\x00\x00\x00\x00\x00\x00\x00{}      "])
def test_a_file_of_another_kind_is_refused(content, tmp_path):
    (tmp_path / "other.safetensors").write_bytes(content)
    with pytest.raises(DocumentError):
        make_policy(str(tmp_path / "other.safetensors"))


def test_a_file_without_layers_or_with_infinite_numbers_is_refused(tmp_path):
    import torch

    from labgym.policies.adapters.actor_file import ActorHeader, Perceptron

    header = ActorHeader(algorithm="PPO", inputs=("goal",), activation="tanh", squash=False)
    path = Perceptron(header, (), {}).save(tmp_path / "none.safetensors")
    with pytest.raises(DocumentError, match="layers"):
        make_policy(str(path))
    infinite = ((torch.full((2, 3), torch.inf), torch.zeros(2)),)
    path = Perceptron(header, infinite, {}).save(tmp_path / "infinite.safetensors")
    with pytest.raises(DocumentError, match="infinite"):
        make_policy(str(path))
    wide = ((torch.zeros(2, 4), torch.zeros(2)),)
    path = Perceptron(header, wide, {}).save(tmp_path / "wide.safetensors")
    with pytest.raises(LabgymError, match="4 to 2 numbers"):
        make_policy(str(path))


def recurrent_policy(shares: bool):
    """Return a policy class with an LSTM, which hands its state out (as sb3-contrib does) or keeps it to itself."""

    class LstmPolicy(MultiInputActorCriticPolicy):
        def __init__(self, *arguments, **options):
            super().__init__(*arguments, **options)
            self.lstm = nn.LSTM(185, 185, batch_first=True)
            self.kept = None

        def predict(self, observation, state=None, episode_start=None, deterministic=False):
            actions, _ = super().predict(observation, None, episode_start, deterministic)
            return (actions, (np.ones((1, 4)),)) if shares else (actions, None)

    return LstmPolicy


class Halved(CombinedExtractor):
    """The usual extractors by name, and another result."""

    def forward(self, observations):
        return 0.5 * super().forward(observations)


class Stateful(MultiInputActorCriticPolicy):
    """Without a recurrent module: the action depends on the number of calls."""

    calls = 0

    def _predict(self, observation, deterministic=False):
        self.calls += 1
        return super()._predict(observation, deterministic) + 0.01 * self.calls


class Doubled(nn.Tanh):
    def forward(self, values):
        return 2.0 * super().forward(values)


@pytest.mark.parametrize("policy", [recurrent_policy(True), recurrent_policy(False), Stateful])
def test_a_policy_with_memory_is_refused_and_nothing_is_written(policy, blank, usual_space, tmp_path):
    model = PPO(policy, environments(blank, usual_space), policy_kwargs=dict(SMALL), device="cpu")
    with pytest.raises(OptionError, match="would lack"):
        save_policy(model, tmp_path / "policy.safetensors")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "options",
    [
        {"features_extractor_class": Halved},
        {"activation_fn": Doubled},
        {"activation_fn": nn.LeakyReLU},
        {"activation_fn": nn.PReLU},
    ],
)
def test_a_network_with_other_parts_is_refused(options, blank, usual_space, tmp_path):
    model = PPO("MultiInputPolicy", environments(blank, usual_space), policy_kwargs={**SMALL, **options}, device="cpu")
    with pytest.raises(OptionError):
        save_policy(model, tmp_path / "policy.safetensors")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("algorithm", [PPO, SAC])
def test_a_policy_of_stacked_frames_sees_the_last_ones(algorithm, blank, usual_space, observations, tmp_path):
    made = VecNormalize(VecFrameStack(environments(blank, usual_space), 3), clip_obs=1.5)
    made.reset()
    for _ in range(10):
        made.step(np.zeros((1, 2), np.float32))
    model = algorithm("MultiInputPolicy", made, policy_kwargs=dict(SMALL), seed=1, device="cpu")
    policy = make_policy(str(save_policy(model, tmp_path / "policy.safetensors")))
    for _ in range(2):  # An episode begins with frames of zeros.
        policy.reset(start())
        frames = {name: [np.zeros(len(observations[0][name]), np.float32)] * 2 for name in usual_space}
        for each in observations:
            for name, earlier in frames.items():
                earlier.append(each[name])
            inputs = {name: np.concatenate(earlier[-3:]) for name, earlier in frames.items()}
            expected, _ = model.predict(made.normalize_obs(inputs), deterministic=True)
            np.testing.assert_allclose(policy.act(each), expected, rtol=0.0, atol=2e-6)


@pytest.mark.parametrize("layers", [1, 2])
@pytest.mark.parametrize("frames", [1, 2])
def test_a_recurrent_policy_remembers_until_the_next_episode(
    layers, frames, blank, usual_space, observations, tmp_path
):
    contrib = pytest.importorskip("sb3_contrib")
    inner = environments(blank, usual_space)
    made = VecNormalize(VecFrameStack(inner, frames) if frames > 1 else inner, clip_obs=1.5)
    made.reset()
    options = {"net_arch": [8], "lstm_hidden_size": 6, "n_lstm_layers": layers}
    model = contrib.RecurrentPPO("MultiInputLstmPolicy", made, n_steps=8, policy_kwargs=options, seed=1, device="cpu")
    policy = make_policy(str(save_policy(model, tmp_path / "policy.safetensors")))
    actions = []
    for _ in range(2):
        policy.reset(start())
        state, earlier = None, {name: [np.zeros_like(observations[0][name])] for name in usual_space}
        for number, each in enumerate(observations):
            for name, seen in earlier.items():
                seen.append(each[name])
            inputs = {name: np.concatenate(seen[-frames:]) for name, seen in earlier.items()}
            expected, state = model.predict(
                made.normalize_obs(inputs), state=state, episode_start=np.array([number == 0]), deterministic=True
            )
            if number == 10:
                policy.next_goal(start((1.0, 1.0)))  # A chain of goals is one episode.
            actions.append(policy.act(each))
            np.testing.assert_allclose(actions[-1], expected, rtol=0.0, atol=5e-6)
    np.testing.assert_array_equal(actions[: len(observations)], actions[len(observations) :])
    policy.reset(start())
    assert np.abs(policy.act(observations[5]) - actions[5]).max() > 1e-6


@pytest.mark.parametrize("recurrent", [False, True])
def test_a_policy_with_features_of_rays_acts_as_its_model(recurrent, blank, usual_space, observations, tmp_path):
    made, options = environments(blank, usual_space), {"net_arch": [8], "features_extractor_class": Rays}
    options["features_extractor_kwargs"] = {"width": 12}
    if recurrent:
        kind = pytest.importorskip("sb3_contrib").RecurrentPPO
        options |= {"lstm_hidden_size": 6, "shared_lstm": True, "enable_critic_lstm": False}
    policy_name = "MultiInputLstmPolicy" if recurrent else "MultiInputPolicy"
    model = (kind if recurrent else PPO)(
        policy_name, made, n_steps=8, batch_size=8, policy_kwargs=options, seed=1, device="cpu"
    )
    file = save_policy(model, tmp_path / "policy.safetensors")
    policy, state = make_policy(str(file)), None
    policy.reset(start())
    for number, each in enumerate(observations):
        inputs = {name: each[name] for name in usual_space}
        first = np.array([number == 0])
        expected, state = model.predict(inputs, state=state, episode_start=first, deterministic=True)
        np.testing.assert_allclose(policy.act(each), expected, rtol=0.0, atol=5e-6)


def test_an_encoder_that_does_not_fit_is_refused(blank, usual_space, tmp_path):
    from safetensors.torch import load_file, save_file

    options = {"net_arch": [8], "features_extractor_class": Rays, "features_extractor_kwargs": {"width": 12}}
    model = PPO("MultiInputPolicy", environments(blank, usual_space), policy_kwargs=options, seed=1, device="cpu")
    file = save_policy(model, tmp_path / "policy.safetensors")
    with safe_open(file, "pt") as opened:
        metadata = opened.metadata()
    for name, tensor in load_file(file).items():
        if name.startswith("encoder."):
            save_file({**load_file(file), name: tensor[:-1].contiguous()}, tmp_path / "broken.safetensors", metadata)
            with pytest.raises(DocumentError, match=name.replace(".", r"\.")):
                make_policy(str(tmp_path / "broken.safetensors"))
    header = json.loads(metadata["labgym"])
    for change, message in (
        ({"inputs": ["goal", "lidar"]}, "inputs"),
        ({"encoder": 13}, "encoder"),
        ({"stack": 2}, "inputs"),
    ):
        save_file(load_file(file), tmp_path / "broken.safetensors", {"labgym": json.dumps({**header, **change})})
        with pytest.raises(DocumentError, match=message):
            make_policy(str(tmp_path / "broken.safetensors"))
    with pytest.raises(OptionError, match="set observe"):
        PPO("MultiInputPolicy", NearGoal(environments(blank, usual_space)), policy_kwargs=options, device="cpu")
    frames = VecFrameStack(environments(blank, usual_space), 2)
    with pytest.raises((OptionError, RuntimeError)):
        save_policy(PPO("MultiInputPolicy", frames, policy_kwargs=options, device="cpu"), tmp_path / "p.safetensors")


def test_features_of_rays_turn_with_the_robot():
    """Before the layer that tells directions apart, a turn by 12 degrees moves all features by one place."""
    import torch

    from labgym.policies.adapters.ray_encoder import RayEncoder

    encoder, rng = RayEncoder(4), np.random.default_rng(0)
    seen = []
    encoder.last.register_forward_pre_hook(lambda _, inputs: seen.append(inputs[0][0, :960].reshape(32, 30)))
    ranges = rng.uniform(0.3, 8.0, 180).astype(np.float32)
    for turns in (0, 1):
        bearing = 0.4 - math.radians(12.0) * turns
        goal = np.array([2.0, math.cos(bearing), math.sin(bearing), 0.5, 0.1], np.float32)
        encoder(torch.tensor(np.concatenate([goal, np.roll(ranges, -6 * turns)]))[None])
    torch.testing.assert_close(seen[1], seen[0].roll(-1, dims=1), rtol=0.0, atol=1e-5)
    assert not torch.allclose(seen[1], seen[0], atol=1e-3)


def test_a_file_whose_memory_does_not_fit_is_refused(tmp_path):
    import torch

    from labgym.policies.adapters.actor_file import ActorHeader, Perceptron

    header = ActorHeader(algorithm="RecurrentPPO", inputs=("goal",), memory=1, activation="tanh", squash=False)
    layers = ((torch.zeros(2, 4), torch.zeros(2)),)
    memory = (torch.zeros(16, 3), torch.zeros(16, 4), torch.zeros(16), torch.zeros(16))
    good = Perceptron(header, layers, {}, (memory,)).save(tmp_path / "good.safetensors")
    assert make_policy(str(good)).observation == "lidar"
    for number, broken in enumerate((
        (torch.zeros(15, 3), *memory[1:]), (memory[0], torch.zeros(16, 5), *memory[2:]),
        (*memory[:3], torch.zeros(12)), tuple(part.double() for part in memory),
    )):  # fmt: skip
        path = Perceptron(header, layers, {}, (broken,)).save(tmp_path / f"{number}.safetensors")
        with pytest.raises(DocumentError, match=r"memory\.0"):
            make_policy(str(path))
    path = Perceptron(header, ((torch.zeros(2, 5), torch.zeros(2)),), {}, (memory,)).save(tmp_path / "wide.safetensors")
    with pytest.raises(DocumentError, match=r"layers\.0"):
        make_policy(str(path))


def test_normalized_frames_and_other_sizes_are_refused(blank, usual_space, tmp_path):
    stacked = VecFrameStack(environments(blank, usual_space, clip_obs=2.0), 3)
    flat = gym.spaces.Box(-1.0, 1.0, (370,), np.float32)
    wide = gym.spaces.Dict({"lidar": gym.spaces.Box(0.0, 10.0, (360,), np.float32)})
    other = gym.spaces.Dict({"sonar": gym.spaces.Box(0.0, 10.0, (8,), np.float32)})
    models = [
        PPO("MultiInputPolicy", stacked, policy_kwargs=dict(SMALL), device="cpu"),
        PPO("MlpPolicy", environments(blank, flat), policy_kwargs=dict(SMALL), device="cpu"),
        PPO("MultiInputPolicy", environments(blank, wide), policy_kwargs=dict(SMALL), device="cpu"),
        PPO("MultiInputPolicy", environments(blank, other), policy_kwargs=dict(SMALL), device="cpu"),
    ]
    for model in models:
        with pytest.raises(LabgymError):
            save_policy(model, tmp_path / "policy.safetensors")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "wrapper",
    [
        gym.wrappers.NormalizeObservation,
        lambda env: gym.wrappers.RescaleAction(env, np.float32(-0.5), np.float32(0.5)),
        lambda env: gym.wrappers.StickyAction(env, 0.2),
    ],
)
def test_a_wrapper_that_the_file_would_lack_is_refused(wrapper, blank, tmp_path):
    space = gym.spaces.Box(-10.0, 10.0, (185,), np.float32)
    made = DummyVecEnv([lambda: wrapper(blank(space))])
    model = PPO("MlpPolicy", made, policy_kwargs=dict(SMALL), device="cpu")
    with pytest.raises(OptionError):
        save_policy(model, tmp_path / "policy.safetensors")


def test_two_normalizations_are_refused(blank, usual_space, tmp_path):
    made = VecNormalize(environments(blank, usual_space, norm_obs=True))
    model = PPO("MultiInputPolicy", made, policy_kwargs=dict(SMALL), device="cpu")
    with pytest.raises(OptionError, match="2 VecNormalize"):
        save_policy(model, tmp_path / "policy.safetensors")


@pytest.mark.parametrize(
    ("algorithm", "options", "arguments"),
    [
        (PPO, {"net_arch": [], "activation_fn": nn.ReLU}, {}),
        (PPO, {"net_arch": {"pi": [7], "vf": [9, 9]}, "activation_fn": nn.ELU}, {}),
        (PPO, {"net_arch": [8], "activation_fn": nn.SiLU, "share_features_extractor": False}, {}),
        (PPO, {"net_arch": [8], "squash_output": True}, {"use_sde": True}),
        (PPO, {"net_arch": [8], "ortho_init": False}, {"use_sde": True}),
        (SAC, {"net_arch": [8, 8, 8], "activation_fn": nn.Tanh}, {}),
        (SAC, {"net_arch": [8]}, {"use_sde": True}),
        (SAC, {"net_arch": [8], "clip_mean": 0.01}, {"use_sde": True}),
        (SAC, {"net_arch": [8], "clip_mean": 0.0}, {"use_sde": True}),
        (TD3, {"net_arch": []}, {}),
        (DDPG, {"net_arch": {"pi": [6], "qf": [5]}}, {}),
        (A2C, {"net_arch": [6, 5]}, {}),
    ],
)
def test_whatever_is_accepted_acts_as_its_model(algorithm, options, arguments, blank, usual_space, tmp_path):
    made = environments(blank, usual_space, clip_obs=2.0)
    model = algorithm("MultiInputPolicy", made, policy_kwargs=options, seed=3, device="cpu", **arguments)
    policy = make_policy(str(save_policy(model, tmp_path / "policy.safetensors")))
    policy.reset(start())
    usual_space.seed(8)
    for _ in range(20):
        each = usual_space.sample()
        expected, _ = model.predict(made.normalize_obs(each), deterministic=True)
        np.testing.assert_allclose(policy.act({**each, "odometry": np.zeros(3)}), expected, rtol=0.0, atol=5e-6)
