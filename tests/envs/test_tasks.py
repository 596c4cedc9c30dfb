"""Which drive an episode is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from labgym.envs import tasks
from labgym.envs.tasks import TaskSource, load, resolve_layout
from labgym.errors import InfeasibleError, OptionError, UnknownNameError
from labgym.layouts import Layout, splits
from labgym.layouts.splits import published
from labgym.protocols import Protocol, get


def source(split: str = "test", **arguments: Any) -> TaskSource:
    defaults = {"layout": None, "protocol": None, "profile": "default", "episodes_per_layout": 2}
    return TaskSource(split, **{**defaults, **arguments})


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.fixture
def generated(layout: Layout, monkeypatch: pytest.MonkeyPatch) -> list[tuple]:
    """What the generator was asked for; it answers at once with the layout made by hand."""
    calls: list[tuple] = []

    def generate(protocol: Protocol, seed: int, room: str, profile: str) -> Layout:
        calls.append((protocol.id, seed, room, profile))
        return layout.replace(id=f"{protocol.id}-{seed}")

    monkeypatch.setattr(splits, "generate", generate)
    monkeypatch.setattr(tasks, "goal_pairs", lambda layout, protocol: tasks_goal_pairs(layout, "alk_03"))
    return calls


tasks_goal_pairs = tasks.goal_pairs


@pytest.mark.parametrize("split", ["val", "test"])
def test_a_published_split_draws_its_own_layouts(split: str) -> None:
    generator, here = rng(), source(split)
    drawn = {here.draw(generator, {}, fresh=True).layout.id for _ in range(40)}
    assert drawn <= set(published(split))
    assert len(drawn) > 10


def test_a_protocol_narrows_the_draw_to_its_layouts() -> None:
    generator, here = rng(), source(protocol="sub_01")
    for _ in range(5):
        task = here.draw(generator, {}, fresh=True)
        assert task.protocol.id == task.layout.protocol_id == "sub_01"
    assert here.draw(generator, {"protocol": "con_01"}, fresh=True).layout.protocol_id == "con_01"


def test_a_published_layout_is_found_by_its_id_in_any_split() -> None:
    for split in ("val", "test"):
        name = published(split)[0]
        assert resolve_layout(name).hash == load(split, name).hash
        assert source("train", layout=name).draw(rng(), {}, fresh=True).layout.id == name


def test_a_protocol_of_ones_own_can_be_driven(layout: Layout) -> None:
    own = get("alk_03").model_copy(update={"id": "mine"})
    task = source(layout=layout, protocol=own).draw(rng(), {"pair": 1}, fresh=True)
    assert task.protocol.id == "mine"
    assert task.pair.index == 1


def test_training_draws_the_same_layout_for_the_same_seed_and_another_for_another(generated: list[tuple]) -> None:
    here = source("train")
    first, again, other = (here.draw(rng(seed), {}, fresh=True) for seed in (1, 1, 2))
    assert first.layout.id == again.layout.id != other.layout.id
    assert first.pair == again.pair


def test_training_stays_in_a_layout_for_the_episodes_asked_for(generated: list[tuple]) -> None:
    generator, here = rng(), source("train", episodes_per_layout=3)
    drawn = [here.draw(generator, {}, fresh=False).layout.id for _ in range(9)]
    assert [drawn.count(name) for name in dict.fromkeys(drawn)] == [3, 3, 3]


def test_training_moves_on_at_once_when_another_protocol_is_asked_for(generated: list[tuple]) -> None:
    generator, here = rng(), source("train", profile="strict", episodes_per_layout=100)
    here.draw(generator, {"protocol": "alk_03"}, fresh=False)
    here.draw(generator, {"protocol": "con_01"}, fresh=False)
    assert [(name, profile) for name, _, _, profile in generated] == [("alk_03", "strict"), ("con_01", "strict")]


def test_training_passes_over_rooms_that_cannot_hold_a_protocol(
    generated: list[tuple], monkeypatch: pytest.MonkeyPatch
) -> None:
    easy, tries = splits.generate, []

    def fussy(*request: Any) -> Layout:
        tries.append(request)
        if len(tries) < 3:
            raise InfeasibleError("room", ["too small"], "roomy")
        return easy(*request)

    monkeypatch.setattr(splits, "generate", fussy)
    assert source("train").draw(rng(), {}, fresh=True).layout.id.startswith(generated[0][0])
    assert len(tries) == 3


def test_training_layouts_are_really_generated_and_drivable() -> None:
    task = source("train", protocol="alk_03").draw(rng(5), {}, fresh=True)
    assert task.layout.provenance.seed < 10**9
    assert task.layout.find(task.pair.start_location) is not None
    assert task.layout.find(task.pair.goal_location) is not None


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        ({"split": "exam"}, UnknownNameError, "train"),
        ({"protocol": "alchemy"}, UnknownNameError, "alk_03"),
        ({"layout": "test-nowhere"}, UnknownNameError, "test-alk_03"),
        ({"layout": 7}, OptionError, "published id"),
        ({"episodes_per_layout": 0}, OptionError, "at least 1"),
    ],
)
def test_what_does_not_exist_is_refused_with_what_does(arguments: dict, error: type, said: str) -> None:
    with pytest.raises(error, match=said):
        source(**arguments)
