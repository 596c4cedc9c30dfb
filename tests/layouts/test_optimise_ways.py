"""The optimization without ways considers no navigation: what is in the robot's way stays there."""

from __future__ import annotations

import pytest

from labgym.layouts import Layout, Placement, load_published
from labgym.layouts.method import Method
from labgym.layouts.optimise import optimise_assessed
from labgym.layouts.phases import Phases
from labgym.layouts.rules import PAPER
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.trace import Recorder
from labgym.navigation import goal_poses


def in_the_way(asset: str) -> tuple[Layout, Placement]:
    """Return a sound laboratory with an object where the robot works at the hood, and the object."""
    sound = load_published("test", "test-sub_01")
    x, y, _ = goal_poses(sound)["FumeHood"]
    placement = Placement(id="InTheWay", asset=asset, position=(x, y, 0.0))
    return sound.replace(placements=(*sound.placements, placement)), placement


def test_without_ways_an_object_at_a_goal_pose_stays():
    blocked, stool = in_the_way("LabStool")
    assert evaluate_layout(blocked, blocked.protocol, rules="paper").v == 0
    assert evaluate_layout(blocked, blocked.protocol, navigation=True, rules="paper").v > 0
    kept, assessment = optimise_assessed(blocked, blocked.protocol, ways=False, rules="paper")
    assert kept.placement("InTheWay") == stool
    assert any(not move.feasible for move in assessment.transitions)
    cleared, assessment = optimise_assessed(blocked, blocked.protocol, rules="paper")
    assert cleared.placement("InTheWay") != stool
    assert all(move.feasible for move in assessment.transitions)


@pytest.mark.parametrize("asset", ["LabStool", "EquipmentRack"])
def test_without_facility_rules_only_the_refinement_clears_the_way(asset):
    blocked, placement = in_the_way(asset)
    assert evaluate_layout(blocked, blocked.protocol, rules="paper").v == 0
    optimised, assessment = Phases(blocked.protocol, PAPER, Method(refine=False, facility=False)).improved(blocked)
    assert optimised.placement("InTheWay") == placement
    assert assessment.rules == PAPER
    assert any(not move.feasible for move in assessment.transitions)
    recorder = Recorder()
    _, assessment = Phases(blocked.protocol, PAPER, Method(facility=False), recorder).improved(blocked)
    assert all(move.feasible for move in assessment.transitions)
    moves = [one for one in recorder.trace().iterations if one.change and not one.change.empty]
    assert {one.phase for one in moves} == {"refine"}
