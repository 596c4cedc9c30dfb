from __future__ import annotations

import gc
import weakref

from labgym.envs import stage
from labgym.envs.stage import stage_of


def test_equal_layouts_share_a_stage_while_someone_holds_it(layout):
    held = stage_of(layout)
    stage._recent.clear()
    assert stage_of(layout.replace(id="another-name")) is held


def test_a_stage_that_nobody_holds_is_let_go(layout):
    gone = weakref.ref(stage_of(layout))
    stage._recent.clear()
    gc.collect()
    assert gone() is None
