"""Protocols written by a language model: from the inventory alone, checked, and sent back with the findings."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from types import GenericAlias
from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from labgym.assets import Asset
from labgym.documents import Record
from labgym.errors import OptionError
from labgym.llm.client import LanguageModel
from labgym.llm.completion import QUOTED
from labgym.llm.errors import LanguageModelError
from labgym.llm.messages import Message
from labgym.llm.prompting import load_prompt
from labgym.protocols import Protocol, ProtocolError, ReactionType, ReagentUse, Step, derive, examine

REPAIRS = 3
MAX_FINDINGS = 40
ACTIONS = (
    *("Weigh", "Measure", "Prepare", "MakeSolution", "Add", "Stir", "Heat", "Reflux", "Cool", "Purge", "Quench"),
    *("Acidify", "Basify", "Extract", "Wash", "PhaseSeparation", "DrySolution", "Filter", "Concentrate", "Distill"),
    *("Crystallize", "Recrystallize", "Chromatograph", "DrySolid", "DryVacuum", "Diazotize", "Monitor", "Analyze"),
    "Clean",
)
Line = Annotated[str, Field(max_length=400)]


@dataclass(frozen=True)
class Material:
    """What a protocol is written from.

    Attributes:
        request: what is wanted, in somebody's words.
        passages: of known experiments, most similar first.
        inventory: the reagents, instruments and workplaces that may be named.
        priors: what is known of the type of reaction.
    """

    request: str
    passages: Sequence[str]
    inventory: Sequence[Asset]
    priors: Sequence[str] = ()


class LanguageWriter:
    """Writes protocols with a language model.

    Args:
        model: the client.
        repairs: how often a protocol with faults is sent back.
    """

    def __init__(self, model: LanguageModel, repairs: int = REPAIRS) -> None:
        if repairs < 0:
            raise OptionError(f"repairs {repairs} must be at least 0")
        self.model, self.repairs = model, repairs

    def write(self, material: Material) -> Protocol:
        """Return a protocol without faults, its constraints derived.

        Raises:
            LanguageModelError: the model refuses, or gives no usable answer.
            ProtocolError: faults are left after the repairs; carries them all.
        """
        prompt, answer = load_prompt("write_protocol"), _answer(material.inventory)
        inventory = {kind: _names(material.inventory, kind) for kind in ("reagent", "instrument", "facility")}
        asked = prompt.fill(
            request=material.request,
            passages=list(material.passages),
            inventory=inventory,
            priors=list(material.priors),
        )
        label, conversation = prompt.label, asked
        for attempt in range(self.repairs + 1):
            try:
                reply = self.model.ask(label, conversation, answer)
            except LanguageModelError as error:
                if error.reason != "malformed" or not error.reply or attempt == self.repairs:
                    raise
                said, faults = error.reply, [_complaint(None, str(error), "")]
            else:
                protocol = _protocol(reply.answer, material.request)
                found = tuple(finding for finding in examine(protocol) if finding.severity == "fault")
                if not found:
                    return protocol
                if attempt == self.repairs:
                    raise ProtocolError(protocol.id, found)
                said, faults = reply.text, [_complaint(f.step, f.message, f.suggestion) for f in found[:MAX_FINDINGS]]
            repair = load_prompt("repair_protocol")
            label = repair.label
            # The first question and the latest answer are enough; a whole history would outgrow the model's window.
            conversation = (*asked, Message("assistant", said), repair.fill(findings=faults)[-1])
        raise AssertionError("the loop returns or raises")


def _names(inventory: Sequence[Asset], kind: str) -> list[str]:
    return sorted({asset.name for asset in inventory if asset.kind == kind})


def _complaint(step: int | None, problem: str, suggestion: str) -> dict[str, Any]:
    return {"step": step, "problem": problem, "suggestion": suggestion}


def _answer(inventory: Sequence[Asset]) -> type[Record]:
    """Return the form of an answer, in which only names of the inventory can stand.

    Raises:
        OptionError: the inventory lacks reagents, instruments or workplaces.
    """
    names = {kind: _names(inventory, kind) for kind in ("reagent", "instrument", "facility")}
    if not all(names.values()):
        lacking = ", ".join(kind for kind, given in names.items() if not given)
        raise OptionError(f"an inventory without any {lacking}: nothing can be done with it")
    reagent, instrument, place = (_one_of(given) for given in names.values())
    used, action = _one_of(names["reagent"] + names["instrument"]), _one_of(ACTIONS)
    part: Any = create_model("Part", __base__=Record, name=(reagent, ...), role=(Line, ...), amount=(Line, ...))
    step: Any = create_model(
        "WrittenStep",
        __base__=Record,
        location=(place, ...),
        action=(action, ...),
        text=(Line, ...),
        uses=(_many(used), Field(max_length=30)),
        temperature=(Annotated[float, Field(ge=-200.0, le=1500.0)] | None, ...),
        duration=(Annotated[float, Field(gt=0.0, le=100_000.0)], ...),
    )
    return create_model(
        "WrittenProtocol",
        __base__=Record,
        refusal=(Line, ""),
        name=(Line, ""),
        reaction_type=(ReactionType | None, None),
        product=(Line, ""),
        description=(Annotated[str, Field(max_length=2000)], ""),
        reagents=(_many(part), Field(max_length=60)),
        instruments=(_many(instrument), Field(max_length=100)),
        steps=(_many(step), Field(max_length=60)),
    )


def _one_of(names: Sequence[str]) -> Any:
    return Literal[tuple(names)]


def _many(kind: Any) -> Any:
    return GenericAlias(list, (kind,))


def _protocol(written: Any, request: str) -> Protocol:
    """Return what a model wrote as a protocol.

    Raises:
        LanguageModelError: it declines.
    """
    if written.refusal.strip() or not (written.reagents and written.instruments and written.steps):
        why = " ".join(written.refusal.split())[: 2 * QUOTED] or "it gives no steps"
        raise LanguageModelError("refused", f"the language model declines to write the protocol: {why!r}")
    steps = [
        Step(
            index=index,
            location=step.location,
            action=step.action,
            text=step.text,
            uses=tuple(dict.fromkeys(step.uses)),
            temperature=step.temperature,
            duration=step.duration,
        )
        for index, step in enumerate(written.steps, start=1)
    ]
    return derive(
        Protocol(
            id=f"new_{hashlib.sha256(request.encode()).hexdigest()[:12]}",
            name=written.name,
            reaction_type=written.reaction_type or "functional_group_transformation",
            product=written.product,
            description=written.description,
            reagents=tuple(ReagentUse(name=part.name, role=part.role, amount=part.amount) for part in written.reagents),
            instruments=tuple(written.instruments),
            steps=tuple(steps),
        )
    )
