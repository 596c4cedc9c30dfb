"""The optimization without ways considers no navigation: what is in the robot's way stays there."""

from __future__ import annotations

from labgym.layouts import Placement, load_published
from labgym.layouts.optimise import optimise_assessed
from labgym.layouts.rules.objective import evaluate_layout
from labgym.navigation import goal_poses


def test_without_ways_an_object_at_a_goal_pose_stays():
    sound = load_published("test", "test-sub_01").upgraded()
    x, y, _ = goal_poses(sound)["FumeHood"]
    stool = Placement(id="InTheWay", asset="LabStool", position=(x, y, 0.0))
    blocked = sound.replace(placements=(*sound.placements, stool))
    assert evaluate_layout(blocked, blocked.protocol).v == 0
    assert evaluate_layout(blocked, blocked.protocol, navigation=True).v > 0
    kept, assessment = optimise_assessed(blocked, blocked.protocol, ways=False)
    assert kept.placement("InTheWay") == stool
    assert any(not move.feasible for move in assessment.transitions)
    cleared, assessment = optimise_assessed(blocked, blocked.protocol)
    assert cleared.placement("InTheWay") != stool
    assert all(move.feasible for move in assessment.transitions)
