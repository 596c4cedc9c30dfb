"""The document `labgym.trace/1`: every state of a layout from its proposal on, and what was tried between them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, Field, JsonValue, PlainSerializer, WithJsonSchema, model_validator

from labgym.documents import Document, Record
from labgym.errors import DocumentError, LabgymError
from labgym.layouts.floor import Identifier
from labgym.layouts.model import Layout
from labgym.layouts.placement import Placement
from labgym.layouts.records import Assignments, Zones

MOST_PLACEMENTS = 2000


class StateChange(Record):
    """Placements that differ between two states of a layout.

    Attributes:
        placed: the placements that are new or differ, as they are after the change.
        removed: ids of the placements that the change removes.
        order: ids of all placements after the change; None if the others keep their order and new ones follow them.
        zones, assignment: functional zones and their assignment after the change; None if they stay.
    """

    placed: Annotated[tuple[Placement, ...], Field(max_length=MOST_PLACEMENTS)] = ()
    removed: Annotated[tuple[Identifier, ...], Field(max_length=MOST_PLACEMENTS)] = ()
    order: Annotated[tuple[Identifier, ...], Field(max_length=MOST_PLACEMENTS)] | None = None
    zones: Zones | None = None
    assignment: Assignments | None = None

    @classmethod
    def between(cls, before: Layout, after: Layout) -> Self:
        """Return the change that leads from one state of a layout to another."""
        placed = tuple(item for item in after.placements if before.by_id.get(item.id) != item)
        removed = tuple(item.id for item in before.placements if item.id not in after.by_id)
        order = tuple(item.id for item in after.placements)
        return cls(
            placed=placed,
            removed=removed,
            order=None if cls(placed=placed, removed=removed)._order(before) == order else order,
            zones=None if after.zones == before.zones else after.zones,
            assignment=None if after.assignment == before.assignment else after.assignment,
        )

    @property
    def empty(self) -> bool:
        """Whether the change is empty."""
        return self == type(self)()

    def apply(self, layout: Layout) -> Layout:
        """Return the layout after the change.

        Raises:
            LabgymError: the change removes or orders placements that do not exist.
            DocumentError: the result names assets or supports that do not exist.
        """
        if self.empty:
            return layout
        items = {**layout.by_id, **{item.id: item for item in self.placed}}
        order = self._order(layout) if self.order is None else self.order
        unknown = [name for name in (*self.removed, *order) if name not in items]
        if unknown or len(set(order)) < len(order):
            raise LabgymError(f"the change does not fit the layout: {unknown[0] if unknown else 'a repeated id'!r}")
        changed = layout.replace(
            placements=tuple(items[name] for name in order),
            zones=layout.zones if self.zones is None else self.zones,
            assignment=layout.assignment if self.assignment is None else self.assignment,
        )
        changed.check_references("change")
        return changed

    def _order(self, layout: Layout) -> tuple[str, ...]:
        kept = [item.id for item in layout.placements if item.id not in self.removed]
        return (*kept, *(item.id for item in self.placed if item.id not in layout.by_id))


MOST_ITERATIONS = 1000
MOST_TRIALS = 400
"""Most trials of one iteration that are listed; the others are counted."""
MOST_COMMANDS = 200

Phase = Literal["propose", "optimise", "complete", "refine", "repair", "dress", "clutter"]
Verdict = Literal["accepted", "start", "cost_rose", "fitness_fell", "no_gain", "beaten", "invalid"]
"""Outcome of a trial.

accepted: the best state so far. start: the state from which the trials that follow begin. cost_rose: more violations
and facility errors. fitness_fell: as many, but a lower F. no_gain: equal in both. beaten: better, but another trial is
better still, or it has more violations than the first state. invalid: the command cannot be applied.
"""
Count = Annotated[int, Field(ge=0, le=10_000_000)]
Name = Annotated[str, Field(max_length=80)]
Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class TriedCommand(Record):
    """A command that was tried.

    Attributes:
        kind: name of the command, such as `Move`.
        arguments: its fields, by name.
    """

    kind: Name
    arguments: Annotated[dict[Name, JsonValue], Field(max_length=16)] = Field(default_factory=dict)

    @classmethod
    def of(cls, command: Any) -> Self:
        """Return the record of a command, which is a dataclass."""
        fields = {field.name: _plain(getattr(command, field.name)) for field in dataclasses.fields(command)}
        return cls(kind=type(command).__name__, arguments=fields)

    def __str__(self) -> str:
        return f"{self.kind}({', '.join(f'{name}={value}' for name, value in self.arguments.items())})"


class Figures(Record):
    """The figures of one state.

    Attributes:
        v: hard violations, infeasible transitions included.
        errors: broken facility rules of severity error.
        missing: required assets that are not placed.
        fitness: F in [0, 1].
        unreachable, transitions: number U of infeasible transitions, and of all.
        faults: hard violations and facility errors, by kind.
    """

    v: Count
    errors: Count
    missing: Count
    fitness: Annotated[float, Field(ge=0.0, le=1.0)]
    unreachable: Count
    transitions: Count
    faults: Annotated[dict[Name, Count], Field(max_length=32)] = Field(default_factory=dict)

    @property
    def rate(self) -> float:
        """The unreachable rate r = U / N; 0 without transitions."""
        return self.unreachable / self.transitions if self.transitions else 0.0


class Trial(Record):
    """A candidate that was judged.

    Attributes:
        operator: what made it, such as `fast_repair`, `adjust`, `rearrange` or `refine`.
        commands: the commands, none for an operator that changes the layout as a whole.
        verdict: see `Verdict`.
        v, errors, fitness: as judged; v includes infeasible transitions if `unreachable` is not null. All four are
            null for an invalid command.
        worse: increase of each kind of violation or facility error that became more frequent.
        note: further explanation.
    """

    operator: Name
    commands: Annotated[tuple[TriedCommand, ...], Field(max_length=MOST_COMMANDS)] = ()
    verdict: Verdict
    v: Count | None = None
    errors: Count | None = None
    fitness: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    unreachable: Count | None = None
    worse: Annotated[dict[Name, Count], Field(max_length=32)] = Field(default_factory=dict)
    note: Annotated[str, Field(max_length=500)] = ""


class Iteration(Record):
    """One iteration of a phase: what was tried, and the state after it.

    Attributes:
        phase: propose, optimise, complete, refine, repair, dress or clutter.
        level: within `optimise`: room, desktop, rearrange, ways or undo; within `repair`: the stage.
        trials: the trials in order; of several accepted ones the last one stands.
        tried: number of trials, those that are not listed included.
        change: from the state before; empty if no update was accepted.
        hash: `Layout.hash` of the state after.
        figures: of the state after.
    """

    phase: Phase
    level: Name | None = None
    trials: Annotated[tuple[Trial, ...], Field(max_length=MOST_TRIALS)] = ()
    tried: Count = 0
    change: StateChange = StateChange()
    hash: Digest
    figures: Figures

    @property
    def accepted(self) -> bool:
        """Whether the state changed."""
        return not self.change.empty


def _layout(data: Any) -> Any:
    if isinstance(data, Layout):
        return data
    try:
        return Layout.parse(data, "start")
    except DocumentError as error:
        raise ValueError(str(error)) from None


EmbeddedLayout = Annotated[
    Layout,
    BeforeValidator(_layout),
    PlainSerializer(Layout.to_json, return_type=dict),
    WithJsonSchema({"type": "object", "description": "A layout document: see layout-2.json."}),
]


class Trace(Document):
    """Every state of a layout from its proposal on, and what was tried between them.

    Attributes:
        profile: name of the thresholds.
        rules: name of the rule set that the figures are for.
        protocol: id of the protocol that the figures are for; of several protocols, of their combination.
        start: the first state.
        iterations: in order; the first one has the figures of the first state, and no change.
    """

    SCHEMA: ClassVar[str] = "labgym.trace/1"

    profile: Name
    rules: Name = "touchstone"
    protocol: Name | None = None
    start: EmbeddedLayout
    iterations: Annotated[tuple[Iteration, ...], Field(min_length=1, max_length=MOST_ITERATIONS)]

    @model_validator(mode="after")
    def _check_start(self) -> Self:
        if self.iterations[0].accepted:
            raise ValueError("the first iteration describes the first state: it has no change")
        return self

    def states(self) -> Iterator[tuple[Iteration, Layout]]:
        """Yield each iteration with the state after it.

        Raises:
            DocumentError: a change does not fit the state before it, or the state does not have the recorded hash.
        """
        layout = self.start
        for number, iteration in enumerate(self.iterations):
            try:
                layout = iteration.change.apply(layout)
            except LabgymError as error:
                raise DocumentError("trace", f"iterations.{number}.change", str(error)) from None
            if layout.hash != iteration.hash:
                problem = (
                    f"leads to {layout.hash[:12]}, recorded {iteration.hash[:12]}: another catalog, or it was edited"
                )
                raise DocumentError("trace", f"iterations.{number}.hash", problem)
            yield iteration, layout

    def final(self) -> Layout:
        """Return the last state. Raises as `states`."""
        *_, (_, layout) = self.states()
        return layout


def tried_commands(commands: Iterable[Any]) -> tuple[TriedCommand, ...]:
    """Return the records of commands."""
    return tuple(TriedCommand.of(command) for command in commands)


def _plain(value: Any) -> JsonValue:
    if isinstance(value, Record):
        return value.model_dump(mode="json")
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    return value if isinstance(value, str | int | float | bool | None) else str(value)
