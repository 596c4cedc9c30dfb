"""The prepared layouts of a published split stay in memory within a budget."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from labgym.envs import LabPointNavEnv, world
from labgym.envs.residents import Residents
from labgym.envs.stage import LayoutSenses
from labgym.envs.tasks import TaskSource
from labgym.envs.world import World
from labgym.errors import OptionError
from labgym.layouts import load_published, published


@dataclass(eq=False)
class Block:
    nbytes: int


def test_the_objects_used_last_stay_within_the_budget_and_the_last_one_in_any_case():
    residents, rng = Residents(), np.random.default_rng(0)
    blocks = [Block(int(size)) for size in rng.integers(1, 4_000_000, 20)]
    used: list[Block] = []
    for index in rng.integers(20, size=300):
        block = blocks[int(index)]
        block.nbytes += 1000
        residents.keep(block, 10.0)
        used = [*(one for one in used if one is not block), block]
        while len(used) > 1 and sum(one.nbytes for one in used) > 10e6:
            used.pop(0)
        assert list(residents._objects) == used
    residents.keep(big := Block(20_000_000), 10.0)
    assert list(residents._objects) == [big]


def test_all_layouts_of_a_published_split_stay_in_memory():
    world.residents.clear()
    env = LabPointNavEnv(split="val")
    env.reset(seed=0)
    worlds = {}
    for _ in range(60):
        _, info = env.reset()
        ours = worlds.setdefault(info["layout"], env.state.world)
        assert env.state.world is ours
    assert world.KEPT < len(worlds) == len(world.residents)
    assert sum(one.nbytes for one in worlds.values()) == world.residents.nbytes
    world.residents.clear()


def test_the_size_of_a_world_grows_with_what_is_derived():
    layout = load_published("val", published("val")[0])
    one = World(layout)
    assert one.nbytes == 0
    bare = one.model.nbuffer
    assert one.nbytes == bare
    vertices = one.solid.mesh.vertices.nbytes
    assert one.nbytes > bare + vertices
    with_rays = one.nbytes
    field = one.to_go((2.0, 2.0, 0.0))
    assert one.nbytes >= with_rays + field._field.nbytes
    assert World(layout, one.stage(LayoutSenses())).nbytes == one.nbytes


def test_derived_data_are_made_once_and_shared():
    layout, made = load_published("val", published("val")[0]), []
    one = World(layout)

    def build(which):
        made.append(which)
        return np.zeros(1000)

    before = one.nbytes
    assert one.derived("zeros", build) is one.derived("zeros", build)
    assert made == [layout]
    assert one.nbytes == before + 8000


@pytest.mark.parametrize("budget", [-1.0, float("nan"), "512", True])
def test_a_budget_that_is_not_a_size_is_refused(budget):
    with pytest.raises(OptionError, match="resident_mb"):
        TaskSource("val", resident_mb=budget)
