"""The protocol is complete and its steps are in order (paper, appendix B, check ii and hard constraints)."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.protocols.amounts import read_amount
from labgym.protocols.rules.finding import Finding, ProtocolCase

PREPARATION = ("Weigh", "Measure", "Prepare")
PREPARATION_PLACES = ("PreparationBench", "BalanceTable")
ANALYSIS, CLEANING = "Analyze", "Clean"
HOT_ACTIONS = ("Heat", "Reflux", "Distill", "Recrystallize", "DrySolid", "Concentrate")


def fields_are_filled(case: ProtocolCase) -> Iterator[Finding]:
    """Names, roles, amounts, actions, texts and durations are present; heated steps have a temperature."""
    for field in ("name", "description", "product"):
        if not getattr(case.protocol, field).strip():
            yield Finding("field-complete", None, f"{field} is empty", f"give the {field}")
    for use in case.protocol.reagents:
        for field in ("role", "amount"):
            if not getattr(use, field).strip():
                message = f"{field} of reagent {use.name!r} is empty"
                yield Finding("field-complete", None, message, f"give the {field}")
    for step in case.protocol.steps:
        for field in ("action", "text"):
            if not getattr(step, field).strip():
                yield Finding(
                    "field-complete", step.index, f"{field} of step {step.index} is empty", f"give the {field}"
                )
        if step.duration is None or step.duration <= 0.0:
            message = f"step {step.index} has no duration"
            yield Finding("field-complete", step.index, message, "give a duration above 0 minutes")
        if step.action in HOT_ACTIONS and step.temperature is None:
            message = f"step {step.index} ({step.action}) has no temperature"
            yield Finding("field-complete", step.index, message, "give a temperature in degrees Celsius")


def amounts_are_readable(case: ProtocolCase) -> Iterator[Finding]:
    """Amounts have units that `labgym.quantities` knows."""
    for use in case.protocol.reagents:
        for text in read_amount(use.amount).unread:
            message = f"{text!r} of reagent {use.name!r} has a unit that is not known"
            yield Finding("amount-unit", None, message, "use a unit such as g, mL or mmol")


def indices_are_consecutive(case: ProtocolCase) -> Iterator[Finding]:
    """Steps are numbered 1, 2, 3, ..."""
    for expected, step in enumerate(case.protocol.steps, start=1):
        if step.index != expected:
            message = f"step at position {expected} has index {step.index}"
            yield Finding("step-order", step.index, message, f"number the steps from 1 to {len(case.protocol.steps)}")
            return


def preparation_comes_first(case: ProtocolCase) -> Iterator[Finding]:
    """The first step prepares the reagents at a preparation bench or balance table."""
    first = case.protocol.steps[0]
    if first.action not in PREPARATION or first.location not in PREPARATION_PLACES:
        message = f"the first step is {first.action} at {first.location}, not the preparation of reagents"
        suggestion = f"begin with {', '.join(PREPARATION)} at {' or '.join(PREPARATION_PLACES)}"
        yield Finding("preparation-first", first.index, message, suggestion)


def analysis_and_cleaning_come_last(case: ProtocolCase) -> Iterator[Finding]:
    """The product is analyzed, and the last step is cleaning at the sink."""
    last = case.protocol.steps[-1]
    if last.action != CLEANING or last.location != "SinkBench":
        message = f"the last step is {last.action} at {last.location}, not cleaning"
        yield Finding("cleaning-last", last.index, message, f"end with {CLEANING} at SinkBench")
    if not any(step.action == ANALYSIS for step in case.protocol.steps):
        message = "no step analyzes the product"
        yield Finding(
            "analysis-present", None, message, f"add an {ANALYSIS} step at ValidationPlatform before cleaning"
        )


RULES = (
    fields_are_filled,
    amounts_are_readable,
    indices_are_consecutive,
    preparation_comes_first,
    analysis_and_cleaning_come_last,
)
