from __future__ import annotations

import gc
import weakref

from labgym.envs import stage
from labgym.envs.stage import stage_of


def test_equal_layouts_share_a_stage_while_it_is_in_use(layout):
    in_use = stage_of(layout)
    stage._recent.clear()
    assert stage_of(layout.replace(id="another-name")) is in_use


def test_a_stage_that_is_not_in_use_is_freed(layout):
    reference = weakref.ref(stage_of(layout))
    stage._recent.clear()
    gc.collect()
    assert reference() is None
