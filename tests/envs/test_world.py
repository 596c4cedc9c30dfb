from __future__ import annotations

import gc
import weakref

from labgym.envs import world
from labgym.envs.world import world_of


def test_equal_layouts_share_a_world_while_it_is_in_use(layout):
    in_use = world_of(layout)
    world._recent.clear()
    assert world_of(layout.replace(id="another-name")) is in_use


def test_a_world_that_is_not_in_use_is_freed(layout):
    reference = weakref.ref(world_of(layout))
    world._recent.clear()
    gc.collect()
    assert reference() is None
