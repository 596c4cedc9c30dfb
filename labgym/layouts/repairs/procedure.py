"""Repair of any layout: hand-edited, imported, or proposed by a model."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from labgym.assets import Asset
from labgym.layouts.adjust import UNITS, Adjuster, LimitedAdjuster, RepairBudget, RuleAdjuster, WorkLimitError
from labgym.layouts.model import Layout
from labgym.layouts.moves import may_move
from labgym.layouts.optimise import optimise_assessed
from labgym.layouts.refinement import refine_assessed
from labgym.layouts.repair import fast_repair
from labgym.layouts.repairs.additions import with_cabinets, with_equipment, with_missing, with_signs
from labgym.layouts.repairs.changes import Change, changes, moved_furniture, moved_ids, problems
from labgym.layouts.repairs.conclusion import advised, economical, warned, widened
from labgym.layouts.repairs.furniture import flush, placed_anew, relocated, settled, under_loads
from labgym.layouts.repairs.rank import RepairState
from labgym.layouts.repairs.reinsertion import reinserted
from labgym.layouts.repairs.resettling import gathered, hung, lying, resettled, taken_down
from labgym.layouts.repairs.safeguards import broken_rules, safeguarded
from labgym.layouts.repairs.softening import softened, without_surplus
from labgym.layouts.request import combination
from labgym.layouts.rules.objective import Assessment
from labgym.layouts.rules.rule_sets import TOUCHSTONE, RuleSet, rule_set
from labgym.layouts.rules.safety.signs import EXIT_SIGNS
from labgym.layouts.rules.storage import STORAGE_CLASSES
from labgym.layouts.trace import Recorder
from labgym.protocols import Protocol

ROUNDS = 3
"""Maximum number of rounds of all stages."""
LEVELS = 2
"""Steps of the rearrangement that are tried before the optimization: only furniture that is involved moves."""


@dataclass(frozen=True)
class Repair:
    """A repaired layout.

    Attributes:
        layout: the layout; the same object if nothing could be improved.
        before, after: assessments with navigation, of the layout as it was and as it is.
        changes: what was changed, object by object, and why.
        problems: what is still wrong, one sentence for each fault; empty if the layout is sound.
    """

    layout: Layout
    before: Assessment
    after: Assessment
    changes: tuple[Change, ...]
    problems: tuple[str, ...]


def repair_layout(
    layout: Layout,
    protocol: Protocol | None = None,
    rules: str | RuleSet = TOUCHSTONE,
    adjuster: Adjuster | None = None,
    trace: Recorder | None = None,
    units: int = UNITS,
    seeded: bool = False,
) -> Repair:
    """Return a layout without the faults of another, as far as they can be repaired.

    Items return to surfaces and reagents to their cabinets, furniture is pushed apart, returned to walls or placed anew
    by the solver, what the protocol requires and is missing is added, and the optimization and the refinement for
    navigation run over the rest. Broken safety rules of the rule set are cured one by one. A stage is kept if the
    layout has fewer faults after it; what need not have moved is put back. Then optional pieces beyond their greatest
    number are removed, and in a layout without faults a few objects move for soft terms alone (`softening`). Fixed
    objects stay exactly where they are. A layout so large or so broken that its repair reaches a limit of work is
    returned as it is then, with that as a problem. Deterministic.

    Args:
        layout: any layout.
        protocol: what the layout is for; by default all protocols of the layout together.
        rules: rule set, with its thresholds.
        adjuster: proposes commands in the optimization; rules and search by default.
        trace: records the state after each stage, and the iterations of the optimization and the refinement.
        units: limit of work (`labgym.layouts.adjust`).
        seeded: whether the layout is drawn by a seed (`RepairState.seeded`).
    """
    protocol = protocol if protocol is not None else _protocol_of(layout)
    start = replace(RepairState.of(layout, protocol, rules, seeded=seeded), work=RepairBudget(units))
    if trace is not None:
        trace.begin(layout, protocol, rule_set(rules))
    progress = RepairProgress(start, trace)
    unfinished: tuple[str, ...] = ()
    try:
        _run(start, progress, adjuster)
    except WorkLimitError as limit:
        unfinished = (str(limit),)
    state = progress.state
    return Repair(
        layout if state is start else state.layout,
        start.assessment,
        state.assessment,
        changes(layout, state.layout, _reasons(start, progress)),
        problems(state) + (unfinished if not state.rank.sound else ()),
    )


@dataclass
class RepairProgress:
    """The state after the last stage, and what objects were moved or removed for in the last one: soft terms."""

    state: RepairState
    trace: Recorder | None
    softened: dict[str, str] = field(default_factory=dict)

    def record(self, stage: str, state: RepairState) -> RepairState:
        """Return a state after recording it."""
        self.state = state
        if self.trace is not None:
            self.trace.update("repair", stage, state.layout)
        return state


def _run(start: RepairState, progress: RepairProgress, adjuster: Adjuster | None) -> None:
    """Carry out rounds of all stages.

    If faults or new warnings are left, all furniture that was moved is taken out of the damaged layout together.
    """
    state = start
    for _ in range(ROUNDS):
        if not curable(state):
            break
        before = state
        state = _round(start.layout, state, adjuster, progress)
        if not state.rank < before.rank:
            break
    if state is not start:
        state = _finished(start, progress, state)
    for soften in () if state.seeded else (without_surplus, softened):
        for better, reason in soften(state):
            progress.softened |= dict.fromkeys(_changed(state, better), reason)
            state = progress.record("soft terms", better)


def _finished(start: RepairState, progress: RepairProgress, state: RepairState) -> RepairState:
    """Return the state at the end of the rounds, with few objects moved and few warnings."""
    state = progress.record("economy", _concluded(start, state))
    if not state.rank.sound or state.rank.narrow or warned(start, state):
        anew = resettled(under_loads(start))
        moved = moved_furniture(start.layout, state.layout)
        other = reinserted(anew, {piece for piece in moved if piece in anew.layout.by_id})
        if other is not anew:
            other = _concluded(start, with_cabinets(with_missing(hung(resettled(other)))))
            state = progress.record("furniture", other if other.rank < state.rank else state)
    return state


def _reasons(start: RepairState, progress: RepairProgress) -> dict[str, str]:
    """Return why objects were changed, by id: the first fault that named each, what was missing, and soft terms."""
    layout, later = start.layout, progress.state.layout
    reasons = {placement.id: _need(later.asset(placement.id)) for placement in later.placements}
    reasons = {item: need for item, need in reasons.items() if item not in layout.by_id}
    for fault in start.assessment.violations.items:
        for item in (item for item in fault.ids if item in layout.by_id):
            for changed in (item, layout.root(item).id):
                reasons.setdefault(changed, fault.message)
    return reasons | progress.softened


def _need(asset: Asset) -> str:
    """Return why a piece was added."""
    storage = asset.storage_class
    return f"reagents of class {storage} had no cabinet" if storage in STORAGE_CLASSES else "required and missing"


def _changed(before: RepairState, after: RepairState) -> list[str]:
    return [change.id for change in changes(before.layout, after.layout)]


def _concluded(start: RepairState, state: RepairState) -> RepairState:
    """Return the state with wider ways, what need not have moved put back, and fewer warnings."""
    if state.rank.narrow:
        state = widened(state, moved_furniture(start.layout, state.layout))
    state = advised(start, economical(start, state))
    return flush(state, moved_ids(start.layout, state.layout))


def _protocol_of(layout: Layout) -> Protocol | None:
    several = layout.protocols
    return combination(several, layout.catalog) if len(several) > 1 else layout.protocol


def _round(layout: Layout, state: RepairState, adjuster: Adjuster | None, progress: RepairProgress) -> RepairState:
    """Return the state after every stage, each of which is kept if it improves the rank.

    Args:
        layout: the layout before the repair.
    """
    record = progress.record
    state = record("loads", under_loads(state))
    state = record("surfaces", hung(gathered(resettled(state))))
    pushed = _better(state, fast_repair(state.layout, state.profile))
    state = record("fast_repair", pushed if settled(pushed) else state)
    state = record("additions", with_cabinets(with_missing(with_signs(with_equipment(state)))))
    state = record("safeguards", safeguarded(state))
    if curable(state) and not settled(state):
        state = record("furniture", reinserted(state))
    if curable(state):
        state = record("furniture", relocated(state))
        state = record("surfaces", resettled(_better(state, fast_repair(state.layout, state.profile))))
    if curable(state) and not settled(state):
        state = record("furniture", reinserted(state, moved_furniture(layout, state.layout)))
        state = record("surfaces", resettled(state))
    state = record("safeguards", safeguarded(with_equipment(state)))
    if curable(state):
        state = record("ways", widened(state, moved_furniture(layout, state.layout)))
    if curable(state):
        state = record("furniture", resettled(placed_anew(state, LEVELS)))
    if curable(state):
        state = record("undo", _optimised(state, adjuster, progress.trace))
        state = record("surfaces", resettled(state))
    return state


def curable(state: RepairState) -> bool:
    """Whether a layout has a fault in which something takes part that may move, or lacks something."""
    assessment, layout = state.assessment, state.layout
    unmarked = any(issue.rule == EXIT_SIGNS.name for issue in broken_rules(state))
    if assessment.lacking or unmarked or assessment.errors or any(not leg.feasible for leg in assessment.drives):
        return True
    faults: list[tuple[str, ...]] = [(fault.id,) for fault in assessment.bounds]
    faults += [collision.ids for collision in assessment.collisions]
    faults += [instance.ids for instance in assessment.instances if instance.hard]
    faults += [issue.ids for issue in broken_rules(state)]
    items = (
        {item for ids in faults for item in ids if item in layout.by_id} | set(lying(layout)) | set(taken_down(layout))
    )
    return any(may_move(layout, each) for item in items for each in (item, layout.root(item).id))


def _better(state: RepairState, layout: Layout) -> RepairState:
    if layout.placements == state.layout.placements:
        return state
    proposed = state.with_layout(layout)
    return proposed if proposed.rank < state.rank else state


def _optimised(state: RepairState, adjuster: Adjuster | None, trace: Recorder | None) -> RepairState:
    """Return the state after the optimization and, if only ways are left to clear, the refinement for navigation."""
    limited = LimitedAdjuster(adjuster if adjuster is not None else RuleAdjuster(), state.work)
    layout, assessment = optimise_assessed(state.layout, state.protocol, state.assessment.rules, limited, trace)
    blocked = sum(not leg.feasible for leg in assessment.drives)
    if state.protocol is not None and blocked and blocked == assessment.v:
        # The solver has tried by now; for every update of the refinement it would take minutes.
        layout, assessment = refine_assessed(layout, assessment, state.protocol, limited, trace=trace, solver=False)
    proposed = replace(state, layout=layout, assessment=assessment)
    return proposed if proposed.rank < state.rank else state
