from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import numpy as np
import pytest

pytest.importorskip("torch")

import torch

from labgym.cards.local import write_imitation_card, write_reinforcement_card
from labgym.errors import DocumentError, LabgymError, OptionError
from labgym.eval.labnav.results import DriveTerms
from labgym.policies.local.inputs import SIZE, place_of
from labgym.policies.local.policy import LocalPolicy, checked_actor
from labgym.runs import ExecutorOptions
from labgym.training.local import ablation, collection, imitation, practice, reinforcement
from labgym.training.local.ablation import (
    BEFORE,
    EXPERT,
    HIDDEN,
    SINGLE,
    UNGUARDED,
    WHOLE,
    Ablation,
    ablate_imitation,
    ablate_reinforcement,
)
from labgym.training.local.collection import GOALS, Apprentice, TrainingDrive, drive, read_records, record_drives
from labgym.training.local.imitation import imitate
from labgym.training.local.model import actor_of, mean_actions, new_model, save_actor
from labgym.training.local.options import ImitationOptions, ReinforcementOptions
from labgym.training.local.practice import make_practice, practice_files, read_floor
from labgym.training.local.reinforcement import filled, make_learner, reinforce, update
from labgym.training.local.rewards import PROGRESS, SCALE, TIME, final_reward, rewards_of
from labgym.training.local.schedule import drawn_drives, weights_by_failure

IMITATION = ImitationOptions(
    tasks=("dock",), rounds=2, drives=2, shard=1, epochs=2, last_epochs=2, batch=64, validation=1
)
PPO = ReinforcementOptions(
    tasks=("dock",), iterations=2, drives=2, shard=1, critic_iterations=1, evaluate_every=5, validation=1
)


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@contextmanager
def hurried() -> Iterator[None]:
    """Drives of this process end after 12 s: a network that has learned nothing seldom arrives before the limit."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(collection, "DriveTerms", partial(DriveTerms, seconds=12.0))
        yield


@pytest.fixture(scope="module")
def floors(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(practice, "TASKS", ("dock", "people", "carry"))
        return make_practice(tmp_path_factory.mktemp("practice"), 1, 1)


@pytest.fixture(scope="module", autouse=True)
def judged_on_the_practice_floor(floors):
    """Ten floors of floors-val take a minute."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (imitation, reinforcement, ablation):
            patch.setattr(module, "validation_floors", lambda out: floors)
        yield


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    return save_actor(new_model(0, 0.1), tmp_path_factory.mktemp("network") / "n.safetensors", "none")


@pytest.fixture(scope="module")
def imitated(floors, tmp_path_factory):
    with hurried():
        return imitate(IMITATION, floors, tmp_path_factory.mktemp("imitation") / "run")


def test_rewards_add_costs_progress_and_the_end():
    costs = [-0.1, -0.2, -0.3, -0.4]
    rewards = rewards_of(costs, [0, 2], [0.1, 0.2], [(2, 3.0)])
    assert rewards == pytest.approx(SCALE * np.array([-0.3 + 0.1 * PROGRESS, -0.7 + 0.2 * PROGRESS + 3.0]))


def test_each_drive_of_a_shift_has_its_end():
    rewards = rewards_of([0.0] * 4, [0, 1, 3], [0.0] * 3, [(1, 5.0), (0, 7.0), (2, -4.0)])
    assert rewards == pytest.approx(SCALE * np.array([5.0, 0.0, -4.0]))
    assert len(rewards_of([0.0], [], [], [(0, 1.0)])) == 0


def test_standing_never_pays():
    assert rewards_of([TIME] * 300, [0], [0.0], [(1, final_reward(0.0, False, False))])[0] < 0.0
    assert final_reward(0.0, False, True) < final_reward(0.0, False, False) < final_reward(0.1, True, False)


def test_the_advantages_are_those_of_the_formula():
    options = ReinforcementOptions(discount=0.9, trace=0.8)
    learner = make_learner(options)
    rng = np.random.default_rng(0)
    lengths, rewards = (3, 1, 2), rng.standard_normal(6).astype(np.float32)
    records = {
        "inputs": rng.standard_normal((6, SIZE)).astype(np.float32),
        "actions": rng.standard_normal((6, 2)).astype(np.float32),
        "rewards": rewards,
        "lengths": np.array(lengths),
    }
    buffer = filled(learner.policy, [records], options)
    values = buffer.values.ravel()
    expected, begin = [], 0
    for length in lengths:
        advantage = 0.0
        episode = []
        for k in reversed(range(begin, begin + length)):
            following = values[k + 1] if k + 1 < begin + length else 0.0
            advantage = rewards[k] + 0.9 * following - values[k] + 0.9 * 0.8 * advantage
            episode.append(advantage)
        expected += reversed(episode)
        begin += length
    assert buffer.advantages.ravel() == pytest.approx(expected, rel=1e-4, abs=1e-5)


def test_an_update_makes_rewarded_actions_likelier_and_a_warm_up_moves_the_critic_alone():
    options = ReinforcementOptions(iterations=10, epochs=10, batch=64, rate=1e-3, divergence=10.0)
    rng = np.random.default_rng(0)
    learner = make_learner(options)

    def drawn():
        inputs = rng.standard_normal((256, SIZE)).astype(np.float32)
        with torch.inference_mode():
            mean = mean_actions(learner.policy, torch.from_numpy(inputs)).numpy()
        noise = 0.15 * rng.standard_normal((256, 2)).astype(np.float32)
        lengths = np.ones(256, np.int64)
        return mean, {"inputs": inputs, "actions": mean + noise, "rewards": noise[:, 0], "lengths": lengths}

    mean, records = drawn()
    update(learner, [records], options, 0, warming=True)
    with torch.inference_mode():
        assert np.array_equal(mean_actions(learner.policy, torch.from_numpy(records["inputs"])).numpy(), mean)
    mean, records = drawn()
    inputs = records["inputs"]
    update(learner, [records], options, 1, warming=False)
    with torch.inference_mode():
        after = mean_actions(learner.policy, torch.from_numpy(inputs)).numpy()
    assert (after[:, 0] - mean[:, 0]).mean() > 0.01
    assert abs((after[:, 1] - mean[:, 1]).mean()) < (after[:, 0] - mean[:, 0]).mean()


def test_practice_floors_are_read_back(floors):
    layout, floor = read_floor(floors[0])
    assert floor.layout_hash == layout.hash
    assert {"dock", "people", "carry"} <= set(floor.episodes)
    assert practice_files(floors[0].parent.parent) == floors


def test_unfinished_practice_is_refused(tmp_path):
    with pytest.raises(LabgymError, match="local-practice"):
        practice_files(tmp_path)


def test_drives_are_drawn_for_each_task_alike(floors):
    drives = drawn_drives(floors, ("dock", "carry"), 6, 0, 0)
    assert sorted(one.task for one in drives) == ["carry"] * 3 + ["dock"] * 3
    assert drives == drawn_drives(floors, ("dock", "carry"), 6, 0, 0) != drawn_drives(floors, ("dock",), 6, 0, 1)
    with pytest.raises(ValueError, match="tea"):
        imitate(ImitationOptions(tasks=("tea",)), floors, floors[0].parent / "none")


def test_tasks_that_fail_are_practiced_more_often(floors):
    weights = weights_by_failure({"dock": 1.0, "carry": 0.4})
    assert weights == pytest.approx({"dock": 0.2, "carry": 0.8})
    drives = drawn_drives(floors, ("dock", "carry"), 10, 0, 0, weights)
    assert sorted(one.task for one in drives) == ["carry"] * 8 + ["dock"] * 2


def test_the_expert_drives_as_the_stack_does(floors, network):
    """Looking over its shoulder changes nothing."""
    from labgym.envs.labnav.tasks import HEADLINE
    from labgym.eval.labnav.drive import drive_floor
    from labgym.policies import make_policy

    layout, floor = read_floor(floors[0])
    episodes = floor.episodes["dock"][:1]
    (alone,) = drive_floor(make_policy("stack"), layout, episodes, DriveTerms("dock", HEADLINE, "stack", "practice", 5))
    row, records = drive(Apprentice(checked_actor(network), "expert"), TrainingDrive(floors[0], "dock", 0, 5))
    assert (row.score, row.time, row.path_length) == (alone.row.score, alone.row.time, alone.row.path_length)
    assert len(records["advice"]) == len(records["inputs"]) == len(records["rewards"]) > 20
    assert np.abs(records["advice"]).max() <= 1.0


def test_a_shift_is_practiced_for_two_goals(network, tmp_path, monkeypatch):
    monkeypatch.setattr(practice, "TASKS", ("shift",))
    one = next(file for file in practice.validation_floors(tmp_path) if read_floor(file)[1].episodes["shift"])
    assert len(read_floor(one)[1].episodes["shift"][0].lengths) > GOALS
    row, records = drive(Apprentice(checked_actor(network), "expert"), TrainingDrive(one, "shift", 0, 6))
    assert row.goals == GOALS
    assert len(records["lengths"]) == len(row.legs)
    assert records["lengths"].sum() == len(records["rewards"])
    ends = np.cumsum(records["lengths"]) - 1
    assert row.legs[-1].success
    assert records["rewards"].argmax() in ends


def test_noise_depends_on_the_seed_of_the_drive_alone(floors, network):
    drives = [TrainingDrive(floors[0], "dock", 0, 3), TrainingDrive(floors[0], "dock", 0, 4)]
    both = read_records(record_drives(drives, network, "noisy", (0.2, 0.2)).files["drives.npz"])
    second = read_records(record_drives(drives[1:], network, "noisy", (0.2, 0.2)).files["drives.npz"])
    first = int(both["lengths"][0])
    assert np.array_equal(both["actions"][first:], second["actions"])
    assert not np.array_equal(both["actions"][:5], second["actions"][:5])
    assert len(both["advice"]) == 0


def test_imitation_learns_the_advice(floors):
    """On inputs that the advice depends on, the error falls on samples that it did not learn from."""
    rng = np.random.default_rng(0)
    weights = rng.standard_normal((SIZE, 2)) / math.sqrt(SIZE)

    def records(count: int):
        inputs = rng.standard_normal((count, SIZE)).astype(np.float32)
        return {"inputs": inputs, "advice": np.tanh(inputs @ weights).astype(np.float32)}

    parts = [records(200) for _ in range(20)]
    model = new_model(0, 0.1)
    options = ImitationOptions(batch=128)
    others = records(400)

    def error() -> float:
        with torch.inference_mode():
            return float((mean_actions(model, torch.from_numpy(others["inputs"])).numpy() - others["advice"]).std())

    imitation.fit(model, parts, options, 0, 1)
    before = error()
    learned = imitation.fit(model, parts, options, 0, 30)
    assert error() < 0.6 * before
    assert learned < imitation.fit(new_model(0, 0.1), parts, options, 0, 1)


@pytest.mark.slow
def test_a_run_gives_the_same_bytes_with_two_workers(floors, tmp_path):
    one, two = (imitate(IMITATION, floors, tmp_path / f"{n}", ExecutorOptions(workers=n)) for n in (1, 2))
    assert two.read_bytes() == one.read_bytes()


def test_a_run_gives_the_same_bytes_after_an_interruption(floors, imitated, tmp_path, monkeypatch):
    one = imitated
    usual, calls = imitation.fit, []

    def stop(*arguments):
        calls.append(arguments)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return usual(*arguments)

    monkeypatch.setattr(imitation, "fit", stop)
    with hurried():
        with pytest.raises(KeyboardInterrupt):
            imitate(IMITATION, floors, tmp_path / "three")
        monkeypatch.setattr(imitation, "fit", usual)
        assert imitate(IMITATION, floors, tmp_path / "three").read_bytes() == one.read_bytes()
    history = [json.loads(line) for line in one.with_name("history.jsonl").read_text().splitlines()]
    assert [record.get("driver") for record in history] == ["expert", "network", None]
    assert history[-1]["kind"] == "validation"
    assert list(history[-1]["scores"]) == ["dock"]
    assert checked_actor(one).header.algorithm == "imitation"
    with pytest.raises(OptionError):
        imitate(IMITATION.model_copy(update={"seed": 1}), floors, one.parent)


def test_the_ablation_compares_each_variant_with_the_whole_network(imitated, tmp_path):
    with hurried():
        results = Ablation.load(ablate_imitation(imitated.parent, tmp_path / "ablation"))
    assert [one.name for one in results.variants] == [WHOLE, EXPERT, *HIDDEN]
    assert results.drives == 1
    assert results.variants[0].difference is None
    means = [sum(one.scores.values()) / len(one.scores) for one in results.variants]
    for one, mean in zip(results.variants[1:], means[1:], strict=True):
        assert one.difference is not None
        assert one.difference.value == pytest.approx(mean - means[0], abs=1e-4)
    card = write_imitation_card([imitated.parent], tmp_path / "card", ablation=tmp_path / "ablation").read_text()
    assert "## Ablation" in card
    assert "without people" in card
    networks = {name: tmp_path / "ablation" / "networks" / f"{name}.safetensors" for name in (WHOLE, "people")}
    first = {name: checked_actor(path).layers[0][0][:, place_of("people")] for name, path in networks.items()}
    assert not first["people"].any()
    assert first[WHOLE].any()
    (tmp_path / "empty").mkdir()
    for name in ("options.json", "manifest.json"):
        (tmp_path / "empty" / name).write_bytes(imitated.with_name(name).read_bytes())
    with pytest.raises(DocumentError, match="no recorded drives"):
        ablate_imitation(tmp_path / "empty", tmp_path / "other")


@pytest.mark.slow
def test_the_cards_show_training_seeds_and_ablation(floors, imitated, network, tmp_path):
    ablated = ablate_imitation(imitated.parent, tmp_path / "ablation").parent
    card = write_imitation_card([imitated.parent, imitated.parent], tmp_path / "card", ablation=ablated).read_text()
    assert "## Ablation" in card
    assert "without people" in card
    assert (tmp_path / "card" / "ablation.json").read_bytes() == (ablated / "ablation.json").read_bytes()
    assert card.count("| 0 |") >= 2
    assert (tmp_path / "card" / "policy.safetensors").read_bytes() == imitated.read_bytes()
    run = reinforce(PPO.model_copy(update={"iterations": 1}), network, floors, tmp_path / "ppo")
    unlike = ablate_reinforcement(run.parent, network, tmp_path / "unlike", [run.parent], each=1)
    results = Ablation.load(unlike)
    assert [one.name for one in results.variants] == [WHOLE, BEFORE, UNGUARDED, SINGLE]
    assert results.variants[3].difference.value == 0.0  # the same weights
    card = write_reinforcement_card([run.parent], tmp_path / "card-ppo", ablation=unlike.parent).read_text()
    assert "stable-baselines3" in card
    assert "without the safety layer" in card
    assert "--tasks dock --seed 0" in card
    published = ablate_reinforcement(tmp_path / "card-ppo", network, tmp_path / "published", each=1)
    assert [one.scores for one in Ablation.load(published).variants] == [one.scores for one in results.variants[:3]]
    with pytest.raises(OptionError, match="ablation of other weights"):
        write_reinforcement_card([run.parent], tmp_path / "wrong", ablation=ablated)
    with pytest.raises(OptionError, match="did not begin with"):
        ablate_reinforcement(run.parent, imitated, tmp_path / "none")
    (tmp_path / "unfinished").mkdir()
    for name in ("options.json", "history.jsonl", "policy.safetensors"):
        (tmp_path / "unfinished" / name).write_bytes(run.with_name(name).read_bytes())
    with pytest.raises(OptionError, match="no finished training"):
        write_reinforcement_card([tmp_path / "unfinished"], tmp_path / "wrong")
    with pytest.raises(OptionError, match="no finished training"):
        ablate_reinforcement(tmp_path / "unfinished", network, tmp_path / "none")
    assert not (tmp_path / "wrong").exists()
    with pytest.raises(LabgymError, match="no such file"):
        ablate_reinforcement(run.parent, tmp_path / "none.safetensors", tmp_path / "none")
    assert not (tmp_path / "none").exists()
    with pytest.raises(OptionError, match="one run for each of dock"):
        ablate_reinforcement(run.parent, network, tmp_path / "other", [run.parent] * 2)
    assert (tmp_path / "card-ppo" / "learning.png").stat().st_size > 1000


def test_ppo_resumes_to_the_same_bytes(floors, network, tmp_path, monkeypatch):
    with hurried():
        whole = reinforce(PPO, network, floors, tmp_path / "whole")
    usual = reinforcement.update

    def stop(learner, records, options, number, warming):
        if number == 1:
            raise KeyboardInterrupt
        return usual(learner, records, options, number, warming)

    monkeypatch.setattr(reinforcement, "update", stop)
    with hurried():
        with pytest.raises(KeyboardInterrupt):
            reinforce(PPO, network, floors, tmp_path / "cut")
        monkeypatch.setattr(reinforcement, "update", usual)
        assert reinforce(PPO, network, floors, tmp_path / "cut").read_bytes() == whole.read_bytes()
    assert whole.read_bytes() != network.read_bytes()
    kinds = [json.loads(line)["kind"] for line in (tmp_path / "cut" / "history.jsonl").read_text().splitlines()]
    assert kinds == ["validation", "iteration", "iteration", "validation"]
    assert isinstance(LocalPolicy(weights=whole), LocalPolicy)


def test_the_actor_of_the_model_is_the_network_of_the_file(tmp_path):
    model = new_model(3, 0.2)
    inputs = torch.randn(4, SIZE)
    actor = actor_of(model, "none").network()
    with torch.inference_mode():
        assert torch.allclose(actor(inputs), mean_actions(model, inputs))
        assert torch.allclose(model.get_distribution(inputs).distribution.mean, mean_actions(model, inputs), atol=1e-6)
