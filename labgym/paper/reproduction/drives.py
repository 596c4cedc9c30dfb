"""Drives of a policy in one layout: a row for each transition of the protocol, driven or not."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise

from labgym.documents import Record
from labgym.errors import InfeasibleError
from labgym.eval.driving.drive import drive_layout
from labgym.eval.driving.episode_row import TransitionRow
from labgym.layouts.model import Layout
from labgym.navigation import goal_pairs
from labgym.navigation.goals import location_pose, same_place
from labgym.paper.reproduction.cases import StudyVariant, layout_of
from labgym.paper.reproduction.study import rows_output
from labgym.policies.kernels import kernel_mode
from labgym.policies.process import PolicySource, shared_process
from labgym.protocols import Protocol
from labgym.runs import ShardOutput
from labgym.suites import suite_of

DRIVE_SEED = 0
"""Random seed of the policies."""


class StudyDriveRow(Record):
    """A transition of a protocol, driven by a policy.

    Attributes:
        policy: its name. variant: key of the variant that made the layout. protocol, seed: of the layout.
        index: number of the transition in the protocol. start, goal: its locations.
        driven: whether both locations are placed; a transition that was not driven counts as failed.
        path: whether a path exists for a disc of the planning radius.
        success, spl, contacts: as in the rows of evaluations; SPL is 0 without a path.
    """

    policy: str
    variant: str
    protocol: str
    seed: int
    index: int
    start: str
    goal: str
    driven: bool = False
    path: bool = False
    success: bool = False
    spl: float = 0.0
    contacts: int = 0


def drive_case(
    label: str, policy: str, variants: tuple[StudyVariant, ...], protocol: Protocol, seed: int, profile: str
) -> ShardOutput:
    """Generate the layouts of some variants, drive all transitions with a policy, and return a row for each.

    Args:
        label: of the policy in the rows. policy: its name or file. variants: of the layouts.
        protocol, seed, profile: as of `layout_of`.

    Layouts are generated once in each process, equal layouts are driven once, and the process of a policy stays open
    for the next case.
    """
    rows: list[StudyDriveRow] = []
    drives: dict[str, Mapping[tuple[str, str], TransitionRow]] = {}
    for variant in variants:
        layout = _layout(variant, protocol, seed, profile)
        if layout is not None and layout.hash not in drives:
            drives[layout.hash] = _drives(policy, layout, protocol)
        for index, (start, goal) in enumerate(pairwise(protocol.route)):
            row = StudyDriveRow(
                policy=label,
                variant=variant.key,
                protocol=protocol.id,
                seed=seed,
                index=index,
                start=start,
                goal=goal,
            )
            if layout is None:
                rows.append(row)
            elif not _coincide(layout, start, goal):
                drive = drives[layout.hash].get((start, goal))
                rows.append(row if drive is None else _filled(row, drive))
    return rows_output(f"{label}/{protocol.id}-{seed}", rows)


def _filled(row: StudyDriveRow, drive: TransitionRow) -> StudyDriveRow:
    return row.model_copy(
        update={
            "driven": True,
            "path": drive.shortest_path_length is not None,
            "success": drive.success,
            "spl": drive.spl or 0.0,
            "contacts": drive.contacts,
        }
    )


@lru_cache(maxsize=512)
def _layout(variant: StudyVariant, protocol: Protocol, seed: int, profile: str) -> Layout | None:
    try:
        return layout_of(variant, protocol, seed, profile)[0]
    except InfeasibleError:
        return None


def _drives(policy: str, layout: Layout, protocol: Protocol) -> Mapping[tuple[str, str], TransitionRow]:
    """Return the drives between places that the layout has, by start and goal."""
    steps = tuple(step for step in protocol.steps if layout.find(step.location) is not None)
    if not steps:
        return {}
    scene = layout.replace(protocols=(protocol.model_copy(update={"steps": steps}),))
    pairs = goal_pairs(scene)
    if not pairs:
        return {}
    process = shared_process(PolicySource.named(policy, {}), None, kernel_mode(None).environment)
    drives = drive_layout(process, scene, suite_of([scene]), policy, DRIVE_SEED)
    ends = {pair.index: (pair.start_location, pair.goal_location) for pair in pairs}
    return {ends[drive.row.pair]: drive.row for drive in drives}


def _coincide(layout: Layout, start: str, goal: str) -> bool:
    if layout.find(start) is None or layout.find(goal) is None:
        return False
    return same_place(location_pose(layout, start), location_pose(layout, goal))
