"""Training that begins as imitation: the network comes near an expert that plans on what was seen."""

from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("numba")

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecNormalize

from labgym.errors import OptionError
from labgym.training.environments import make_environments
from labgym.training.guided import Guided, guided
from labgym.training.hyperparameters import Hyperparameters
from labgym.training.run import RunSettings, train

ROOM = {"layout": "test-sub_01", "max_episode_steps": 60}


def distance(model, environments, guide):
    """Return the mean distance of the network's actions from the expert's, on episodes that the network drives."""
    environments.seed(11)
    observations, guide.noting, own, memory = environments.reset(), True, [], None
    guide.labels()
    for step in range(60):
        action, memory = model.predict(observations, memory, np.full(16, step == 0), deterministic=True)
        own.append(action)
        observations = environments.step(action)[0]
    return float(np.abs(np.array(own) - guide.labels()).mean())


@pytest.mark.parametrize("algorithm", ["ppo", pytest.param("recurrent-ppo", marks=pytest.mark.long)])
def test_the_network_comes_near_the_expert(algorithm):
    kind, policy, network = PPO, "MultiInputPolicy", {"net_arch": [64, 64]}
    if algorithm == "recurrent-ppo":
        kind = pytest.importorskip("sb3_contrib").RecurrentPPO
        policy, network = "MultiInputLstmPolicy", {**network, "lstm_hidden_size": 64}
    guide = Guided(make_environments("LabPointNav-v0", 16, "kernel", **ROOM))
    environments = VecNormalize(guide, norm_reward=False)
    options = {"n_steps": 32, "batch_size": 128, "n_epochs": 5, "learning_rate": 2e-3, "seed": 0, "device": "cpu"}
    model = guided(kind, math.inf)(policy, environments, policy_kwargs=network, **options)
    before = distance(model, environments, guide)
    model.learn(12288)
    after = distance(model, environments, guide)
    assert after < 0.75 * before, (after, before)
    guide.close()


@pytest.mark.parametrize("vectorization", ["kernel", "dummy"])
def test_the_expert_drives_to_the_goal_by_what_it_says(vectorization):
    guide = Guided(make_environments("LabPointNav-v0", 2, vectorization, **{**ROOM, "max_episode_steps": 400}))
    guide.seed(4)
    guide.reset()
    guide.noting, successes = True, []
    action = np.zeros((2, 2), np.float32)
    while len(successes) < 4:
        _, _, done, infos = guide.step(action)
        successes += [info["is_success"] for info, ended in zip(infos, done, strict=True) if ended]
        action = guide.labels()[-1] * ~done[:, None]
    assert all(successes)
    guide.close()


def test_imitation_without_ppo_is_refused():
    with pytest.raises(OptionError, match="sac has no imitation"):
        Hyperparameters("sac", "LabPointNav-v0", 1, 1, imitation=100)


def test_imitation_needs_goal_and_lidar_and_environments_in_this_process(tmp_path):
    with pytest.raises(OptionError, match="goal and lidar"):
        Guided(make_environments("LabFloorNavDepth-v0", 1, "dummy", **ROOM))
    imitating = Hyperparameters("ppo", "LabPointNav-v0", 1, 1, imitation=100)
    with pytest.raises(OptionError, match="'processes'"):
        train(imitating, RunSettings(tmp_path, vectorization="processes"))


def test_a_device_that_is_not_there_is_named(tmp_path):
    with pytest.raises(OptionError, match=r"^device 'abacus' is not there"):
        RunSettings(tmp_path, device="abacus")
