"""Protocols written by a language model from the inventory; protocols with faults are returned with the findings."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import GenericAlias
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, create_model

from labgym.assets import Asset, Catalog
from labgym.documents import Record
from labgym.errors import OptionError
from labgym.llm.client import LanguageModel
from labgym.llm.completion import QUOTED
from labgym.llm.errors import LanguageModelError
from labgym.llm.messages import Message
from labgym.llm.prompting import load_prompt
from labgym.protocols.capability import capacity, cools_to, evacuates_to, heats_to, is_ventilated, is_workplace
from labgym.protocols.constraints import derive
from labgym.protocols.errors import RefusalError
from labgym.protocols.model import Protocol, ReactionType, ReagentUse, Step
from labgym.protocols.synthesis.transformations import recognize
from labgym.protocols.synthesis.writer import Commission, WriterResult
from labgym.protocols.validate import ProtocolError, examine, faults

PROMPTS = Path(__file__).resolve().parent / "prompts"
REPAIRS = 3
MAX_FINDINGS = 40
KINDS = ("reagent", "instrument", "facility")
ACTIONS = (
    *("Weigh", "Measure", "Prepare", "MakeSolution", "Add", "Stir", "Heat", "Reflux", "Cool", "Purge", "Quench"),
    *("Acidify", "Basify", "Extract", "Wash", "PhaseSeparation", "DrySolution", "Filter", "Concentrate", "Distill"),
    *("Crystallize", "Recrystallize", "Chromatograph", "DrySolid", "DryVacuum", "Diazotize", "Monitor", "Analyze"),
    "Clean",
)
Line = Annotated[str, Field(max_length=400)]


@dataclass(frozen=True)
class WritingSources:
    """The material from which a model writes a protocol.

    Attributes:
        request: the description as the user wrote it.
        passages: of known experiments, most similar first.
        catalog: the assets that the protocol may use.
        priors: result of the rules about the type of reaction.
    """

    request: str
    passages: Sequence[str]
    catalog: Catalog
    priors: Sequence[str] = ()

    @property
    def inventory(self) -> tuple[Asset, ...]:
        """The reagents, instruments and workplaces of the catalog."""
        return tuple(asset for asset in self.catalog if asset.kind != "facility" or is_workplace(asset))


class LanguageWriter:
    """A `labgym.protocols.synthesis.Writer` that works with a language model.

    Args:
        model: the client.
        repairs: maximum number of times a protocol with faults is returned.
    """

    def __init__(self, model: LanguageModel, repairs: int = REPAIRS) -> None:
        if repairs < 0:
            raise OptionError(f"repairs {repairs} must be at least 0")
        self.model, self.repairs = model, repairs

    def write(self, commission: Commission) -> WriterResult:
        """Return a protocol without faults, and what it took to write it.

        Raises:
            RefusalError: the text names neither a substance nor a reaction.
            LanguageModelError: the model refuses, or gives no usable answer.
            ProtocolError: faults are left after the repairs.
        """
        if not commission.description.spoken_of:
            raise RefusalError("no-chemistry", "the text names neither a substance nor a reaction: say what reacts")
        before = self.model.usage
        protocol, attempts = compose(self.model, writing_sources(commission), self.repairs)
        usage = self.model.usage.since(before)
        return WriterResult(protocol, (f"written by {self.model.config.model} in {attempts} attempts; {usage}",))


def writing_sources(commission: Commission) -> WritingSources:
    """Return the material for a commission: the nearest passages, the catalog and the priors of the rules."""
    passages = [f"{hit.fragment.place} ({hit.fragment.title}): {hit.fragment.text}" for hit in commission.context.hits]
    return WritingSources(commission.text, passages, commission.catalog, _priors(commission))


def compose(model: LanguageModel, sources: WritingSources, repairs: int = REPAIRS) -> tuple[Protocol, int]:
    """Return a protocol without faults, with derived constraints, and the number of attempts.

    Raises:
        LanguageModelError: the model refuses, or gives no usable answer.
        RefusalError: the model writes a protocol of a product that is refused; it is not asked for another one.
        ProtocolError: faults are left after the repairs; carries them all.
    """
    prompt, answer = load_prompt(PROMPTS / "write_protocol.md"), _answer(sources.inventory)
    question = prompt.fill(
        request=sources.request,
        passages=list(sources.passages),
        inventory={kind: _abstracts(sources.inventory, kind) for kind in KINDS},
        priors=list(sources.priors),
    )
    label, conversation, attempts = prompt.label, question, 0
    while True:
        attempts += 1
        try:
            reply = model.ask(label, conversation, answer)
            protocol = _protocol(reply.answer, sources)
        except LanguageModelError as error:
            if error.reason != "malformed" or not error.reply or attempts > repairs:
                raise
            text, complaints = error.reply, [_complaint(None, str(error), "")]
        else:
            found = faults(examine(protocol, sources.catalog))
            if not found:
                return protocol, attempts
            if attempts > repairs:
                raise ProtocolError(protocol.id, found)
            text = reply.text
            complaints = [_complaint(f.step, f.message, f.suggestion) for f in found[:MAX_FINDINGS]]
        repair = load_prompt(PROMPTS / "repair_protocol.md")
        label = repair.label
        # The first question and the latest answer are enough; a whole history would outgrow the model's window.
        conversation = (*question, Message("assistant", text), repair.fill(findings=complaints)[-1])


def _abstracts(inventory: Sequence[Asset], kind: str) -> dict[str, str]:
    """Return the properties of each asset that a writer needs, by name."""
    return {asset.name: "; ".join(_abstract(asset)) for asset in inventory if asset.kind == kind}


def _abstract(asset: Asset) -> Iterator[str]:
    yield asset.subtype
    if asset.chemistry is not None:
        yield asset.chemistry.state
        if asset.chemistry.boiling_point is not None:
            yield f"boils at {asset.chemistry.boiling_point:g} C"
    for measure, unit in ((capacity, "mL"), (heats_to, "C at most"), (cools_to, "C at least"), (evacuates_to, "mbar")):
        value = measure(asset)
        if value is not None:
            yield f"{value:g} {unit}"
    if asset.kind == "facility":
        yield "ventilated" if is_ventilated(asset) else "not ventilated"
    yield from (flag for flag, carried in asset.hazards.model_dump().items() if carried and flag != "glass_container")


def _priors(commission: Commission) -> list[str]:
    """Return the result of the rules: the recognized kind of reaction and the parsed clauses."""
    kind = next(iter(recognize(commission.description.spoken_of)), None)
    priors = []
    if kind is not None:
        priors.append(f"kind of reaction: {kind.name} ({kind.type}); like {kind.like}")
        priors.append(f"usual conditions: {kind.action} at {kind.temperature:g} C for {kind.duration:g} min")
    for clause in commission.description.clauses:
        parts = [f"{name} {amount}" for name, amount in clause.amounts.items()]
        parts += [name for name in clause.names("reagent", "instrument") if name not in clause.amounts]
        parts += [] if clause.temperature is None else [f"{clause.temperature:g} C"]
        parts += [] if clause.duration is None else [f"{clause.duration:g} min"]
        if parts:
            action = clause.operation.action if clause.operation is not None else "named"
            priors.append(f"read in the request: {action}: {', '.join(parts)}")
    return priors


def _names(inventory: Sequence[Asset], kind: str) -> list[str]:
    return sorted({asset.name for asset in inventory if asset.kind == kind})


def _complaint(step: int | None, problem: str, suggestion: str) -> dict[str, Any]:
    return {"step": step, "problem": problem, "suggestion": suggestion}


def _answer(inventory: Sequence[Asset]) -> type[Record]:
    """Return the form of an answer, in which only names of the inventory can stand.

    Raises:
        OptionError: the inventory lacks reagents, instruments or workplaces.
    """
    names = {kind: _names(inventory, kind) for kind in KINDS}
    if not all(names.values()):
        lacking = ", ".join(kind for kind, listed in names.items() if not listed)
        raise OptionError(f"the catalog has no {lacking}; a protocol needs reagents, instruments and facilities")
    reagent, instrument, place = (_one_of(listed) for listed in names.values())
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


def _protocol(answer: Any, sources: WritingSources) -> Protocol:
    """Return a model's answer as a protocol.

    Raises:
        LanguageModelError: it declines, or names no reaction type.
    """
    if answer.refusal.strip() or not (answer.reagents and answer.instruments and answer.steps):
        why = " ".join(answer.refusal.split())[: 2 * QUOTED] or "it gives no steps"
        raise LanguageModelError("refused", f"the language model declines to write the protocol: {why!r}")
    if answer.reaction_type is None:
        message = f"the language model names no reaction_type: one of {', '.join(get_args(ReactionType))}"
        raise LanguageModelError("malformed", message, answer.model_dump_json())
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
        for index, step in enumerate(answer.steps, start=1)
    ]
    return derive(
        Protocol(
            id=f"new_{hashlib.sha256(sources.request.encode()).hexdigest()[:12]}",
            name=answer.name,
            reaction_type=answer.reaction_type,
            product=answer.product,
            description=answer.description,
            reagents=tuple(ReagentUse(name=part.name, role=part.role, amount=part.amount) for part in answer.reagents),
            instruments=tuple(answer.instruments),
            steps=tuple(steps),
        ),
        sources.catalog,
    )
