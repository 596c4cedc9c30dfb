"""Tasks: the layout, protocol and goal pair of an episode."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from labgym.envs import tasks
from labgym.envs.tasks import TaskSource, goal_pair, load, resolve_layout
from labgym.errors import InfeasibleError, OptionError, UnknownNameError
from labgym.layouts import Layout, splits
from labgym.layouts.rules.rule_sets import RuleSet
from labgym.layouts.splits import published
from labgym.protocols import Protocol, get


def source(split: str = "test", **arguments: Any) -> TaskSource:
    return TaskSource(split, **{"episodes_per_layout": 2, **arguments})


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.fixture
def generated(layout: Layout, monkeypatch: pytest.MonkeyPatch) -> list[tuple]:
    """The calls of the generator, which returns the layout made by hand at once."""
    calls: list[tuple] = []

    def generate(protocol: Protocol, seed: int, room: str, profile: str, *, rules: RuleSet) -> Layout:
        assert rules is splits.MADE_UNDER
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


def test_a_user_s_own_protocol_can_be_driven(layout: Layout) -> None:
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

    def fussy(*request: Any, rules: RuleSet) -> Layout:
        tries.append(request)
        if len(tries) < 3:
            raise InfeasibleError("room", ["too small"], "roomy")
        return easy(*request, rules=rules)

    monkeypatch.setattr(splits, "generate", fussy)
    assert source("train").draw(rng(), {}, fresh=True).layout.id.startswith(generated[0][0])
    assert len(tries) == 3


def test_training_layouts_are_really_generated_and_drivable() -> None:
    task = source("train", protocol="alk_03").draw(rng(5), {}, fresh=True)
    assert task.layout.provenance.seed < 10**9
    assert task.layout.find(task.pair.start_location) is not None
    assert task.layout.find(task.pair.goal_location) is not None


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"split": "exam"}, UnknownNameError, "train"),
        ({"protocol": "alchemy"}, UnknownNameError, "alk_03"),
        ({"layout": "test-alk_3"}, UnknownNameError, "nearest: .*test-alk_03"),
        ({"layout": 7}, OptionError, "published id"),
        ({"split": "train", "episodes_per_layout": 0}, OptionError, "at least 1"),
    ],
)
def test_unknown_names_are_refused_with_those_that_exist(arguments: dict, error: type, message: str) -> None:
    with pytest.raises(error, match=message):
        source(**arguments)


def test_a_layout_whose_protocol_stays_at_one_place_says_so(layout: Layout) -> None:
    still = get("alk_03").model_copy(update={"id": "still", "steps": get("alk_03").steps[:1]})
    with pytest.raises(OptionError, match="has no goal pairs: protocol 'still' stays at one place"):
        source(layout=layout.for_protocol(still)).draw(rng(), {}, fresh=True)
    with pytest.raises(OptionError, match="has no goal pairs"):
        goal_pair(layout.for_protocol(still), 0)


def test_an_unknown_pair_lists_the_pairs(layout: Layout) -> None:
    for index in (-1, 99):
        with pytest.raises(
            UnknownNameError, match=f"goal pair of layout 'by-hand' '{index}' not found.* available: 0, 1"
        ):
            source(layout=layout).draw(rng(), {"pair": index}, fresh=True)
    for index, kind in ((True, "bool"), ("0", "str"), (0.0, "float")):
        with pytest.raises(OptionError, match=f"goal pair .* is a {kind}, expected an int below"):
            source(layout=layout).draw(rng(), {"pair": index}, fresh=True)


def test_an_end_that_does_not_fit_a_drawn_layout_names_the_layout(layout: Layout) -> None:
    with pytest.raises(OptionError, match=r"start .*; layout '[a-z_0-9-]+' was drawn"):
        source("test").draw(rng(), {"start": (99.0, 0.0, 0.0)}, fresh=True)
    with pytest.raises(OptionError, match=r"in none of the floor's spaces .*choose a point in one$"):
        source(layout=layout).draw(rng(), {"start": (99.0, 0.0, 0.0)}, fresh=True)
