"""Order of addition: the stages of a reaction, each with the reagents that go in and the period that follows.

A text that says what is added to what, "mix A and B, then add C dropwise", is followed in its own order. A text that
only lists reagents and conditions gets one stage, in the order that is usual for the kind of reaction.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from labgym.assets import Catalog
from labgym.protocols.synthesis.operations import Operation
from labgym.protocols.synthesis.reading import Clause
from labgym.protocols.synthesis.roles import Participant
from labgym.protocols.synthesis.transformations import Transformation

_DILUTES = re.compile(r"\bdilut|稀释", re.IGNORECASE)
QUENCHES = frozenset(
    (
        "HydrochloricAcid",
        "DeionizedWater",
        "AmmoniumChloride",
        "SodiumBicarbonate",
        "SodiumThiosulfate",
        "SodiumBisulfite",
    )
)
"""Reagents that end a reaction when they are added after its reaction time."""
_ADDED_TO = re.compile(r"\b(?:was|is|were|are|being|,)?\s*(?:added|introduced|dropped|poured|charged)\b", re.IGNORECASE)
_ADD = re.compile(
    r"\b(?:add|adding|introduce|charge|drop|run in|(?:dropwise |slow )?addition of|treat(?:ed|ing)?)\b",
    re.IGNORECASE,
)
_DROPWISE = re.compile(r"\b(?:drop-?wise|portion-?wise|in portions|slowly added)\b", re.IGNORECASE)
_TREAT = re.compile(r"\btreat", re.IGNORECASE)
_TO = re.compile(r"\s(?:in)?to\s", re.IGNORECASE)
_WITH = re.compile(r"\swith\s", re.IGNORECASE)
_TO_FIRST = re.compile(r"^\W*(?:in)?to\s", re.IGNORECASE)
_ADD_ZH = re.compile(r"滴加|滴入|加入|加到|加至|添加|通入|倒入")
_IN_ZH = re.compile(r"^[\s]*(?:向|往|在)")


def parted(kind: Transformation, clauses: Sequence[Clause], catalog: Catalog) -> tuple[list[Clause], list[Clause]]:
    """Return the clauses of the reaction and those after it.

    A clause after the reaction belongs to it where it brings in a reagent that the reaction needs, as copper chloride
    that a diazonium salt is poured into.
    """
    needed = {name for slot in kind.slots for name in (slot.asset, *slot.accepts)}
    ends = {kind.quench.asset} if kind.quench is not None else set()
    before: list[Clause] = []
    after: list[Clause] = []
    for clause in clauses:
        ending = _ending(kind, clause, before, catalog)
        clause = replace(clause, operation=ending) if ending is not None else clause
        phase = clause.operation.phase if clause.operation else "reaction"
        present = {name for earlier in before for name in earlier.names("reagent")}
        brings = set(clause.names("reagent")) & (needed - ends - present)
        reacting = phase == "reaction" and not after
        (before if reacting or (phase == "quench" and brings and not after) or not before else after).append(clause)
    return before, after


def _ending(kind: Transformation, clause: Clause, before: Sequence[Clause], catalog: Catalog) -> Operation | None:
    """Return the operation of a clause that ends a reaction which was left to react, or None.

    "stir 2 h, add dilute acid" quenches; "stir 2 h, dilute with ether" begins the extraction.
    """
    needed = {name for slot in kind.slots for name in (slot.asset, *slot.accepts)}
    reagents = set(clause.names("reagent"))
    adds = clause.operation is not None and clause.operation.action == "Add"
    if not adds or not reagents or not any(c.duration for c in before):
        return None
    if reagents <= QUENCHES - needed:
        return Operation("Quench", "quench", 0)
    organic = all(catalog.get(name).category == "organic_solvent" for name in reagents)
    return Operation("Extract", "workup", 0) if _DILUTES.search(clause.text) and organic else None


@dataclass(frozen=True)
class ReactionStage:
    """A part of the reaction.

    Attributes:
        charged: what goes in at once, before anything is added.
        added: what is added afterwards, in order.
        temperature, minutes: temperature and duration of the addition, if the text gives them.
        periods: clauses that say how the mixture is then kept.
    """

    charged: tuple[Participant, ...] = ()
    added: tuple[Participant, ...] = ()
    temperature: float | None = None
    minutes: float | None = None
    periods: tuple[Clause, ...] = ()


@dataclass
class _Draft:
    charged: list[Participant] = field(default_factory=list)
    added: list[Participant] = field(default_factory=list)
    temperature: float | None = None
    minutes: float | None = None
    periods: list[Clause] = field(default_factory=list)

    def stage(self) -> ReactionStage:
        return ReactionStage(
            tuple(self.charged), tuple(self.added), self.temperature, self.minutes, tuple(self.periods)
        )


def stages(
    clauses: Sequence[Clause], parts: Sequence[Participant], is_period: Callable[[Clause], bool]
) -> tuple[ReactionStage, ...]:
    """Return the stages that a text describes; empty if it gives no order.

    Args:
        clauses: clauses of the reaction, in order.
        parts: its participants.
        is_period: whether a clause keeps the mixture at a temperature for a while.
    """
    if not any(_adds(clause) and _newly(clause, parts, ()) for clause in clauses[0:]):
        return ()
    drafts = [_Draft()]
    placed: list[Participant] = []
    for clause in clauses:
        fresh = _newly(clause, parts, placed)
        if fresh and drafts[-1].periods:
            drafts.append(_Draft())
        draft = drafts[-1]
        for part in fresh:
            late = _adds(clause) and _is_added(clause, part)
            if late or len(drafts) > 1 or (draft.added and not _adds(clause)):
                draft.added.append(part)
            else:
                draft.charged.append(part)
        placed += fresh
        if fresh and _adds(clause) and clause.temperature is not None:
            draft.temperature = clause.temperature
        if fresh and _adds(clause) and clause.duration is not None and not is_period(clause):
            draft.minutes = clause.duration
        if is_period(clause):
            draft.periods.append(clause)
    _place_the_rest(drafts, [part for part in parts if part not in placed])
    return tuple(draft.stage() for draft in drafts)


def _place_the_rest(drafts: Sequence[_Draft], rest: Sequence[Participant]) -> None:
    """Assign reagents without a stated stage to their usual one: charged first, or added last."""
    for part in rest:
        if part.when == "add" and drafts[0].charged:
            drafts[-1].added.append(part)
        else:
            drafts[0].charged.append(part)
    if not drafts[0].charged and len(drafts[0].added) > 1:
        drafts[0].charged, drafts[0].added = drafts[0].added[:1], drafts[0].added[1:]


def _adds(clause: Clause) -> bool:
    patterns = (_ADD, _ADDED_TO, _DROPWISE, _ADD_ZH)
    return any(pattern.search(clause.text) is not None for pattern in patterns)


def _newly(clause: Clause, parts: Sequence[Participant], placed: Sequence[Participant]) -> list[Participant]:
    names = clause.names("reagent", "class")
    fresh = [p for p in parts if p.named and p not in placed and (p.stands_for or p.asset.name) in names]
    return sorted(fresh, key=lambda part: names.index(part.stands_for or part.asset.name))


def _is_added(clause: Clause, part: Participant) -> bool:
    """Return whether a clause adds a reagent, rather than naming what it is added to."""
    name = part.stands_for or part.asset.name
    mention = next(mention for mention in clause.mentions if mention.name == name)
    at = mention.start - clause.start
    chinese = _ADD_ZH.search(clause.text)
    if chinese is not None:
        before, after = clause.text[: chinese.start()], clause.text[chinese.end() :]
        into = chinese[0] in ("加到", "加至", "倒入") or after.startswith(("到", "至", "于")) or _ends_inside(after)
        inverted = _IN_ZH.match(before) is not None or before.rstrip().endswith(("中", "下", "里"))
        return (at < chinese.start()) if into and not inverted else at >= chinese.start()
    passive = _ADDED_TO.search(clause.text)
    active = _ADD.search(clause.text)
    if active is not None and not (passive is not None and passive.start() < active.start()):
        marker = _WITH if _TREAT.match(active[0]) else _TO
        target = marker.search(clause.text, active.end())
        if _TREAT.match(active[0]):
            return target is not None and at > target.start()
        return at >= active.end() and (target is None or at < target.start())
    if passive is not None:
        return at < passive.start() and not _TO_FIRST.match(clause.text)
    return _DROPWISE.search(clause.text) is not None


def _ends_inside(after: str) -> bool:
    """Return whether what follows "add" is what it is added to: 加入苯胺的二氯甲烷溶液中."""
    head = re.split(r"[，。；,;]", after)[0]
    return head.rstrip().endswith(("中", "溶液", "里")) and not head.strip().startswith("溶液")
