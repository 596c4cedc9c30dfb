"""Protocols from templates: the kind of reaction gives the frame, the text overrides everything that it states.

A reaction that a text names and that has no template is taken from the library of experiments.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Sequence

from labgym.assets import Catalog
from labgym.errors import LabgymError
from labgym.protocols.amounts import moles_of, scaled
from labgym.protocols.constraints import derive
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments import Experiment, experiments
from labgym.protocols.model import Protocol
from labgym.protocols.refusals import refuse_mixture, refuse_solvent
from labgym.protocols.retrieval import SearchResults
from labgym.protocols.sizing import fitted
from labgym.protocols.synthesis.builder import (
    ProtocolBuilder,
    clean_up,
    short_name,
    weigh_first,
)
from labgym.protocols.synthesis.fidelity import unkept
from labgym.protocols.synthesis.phases import ReactionMixture
from labgym.protocols.synthesis.reaction import ReactionWriter
from labgym.protocols.synthesis.reading import Clause, ParsedDescription
from labgym.protocols.synthesis.roles import Participant, cast
from labgym.protocols.synthesis.stages import parted
from labgym.protocols.synthesis.staging import stage
from labgym.protocols.synthesis.stated_product import stated_product
from labgym.protocols.synthesis.transformations import (
    Transformation,
    classes_of,
    own_reagents,
    recognize,
    transformations,
    with_own_reagents,
)
from labgym.protocols.synthesis.workup import WorkUp
from labgym.protocols.synthesis.workup_plan import work_up_steps
from labgym.protocols.synthesis.writer import Commission, WriterResult

_AGENT = re.compile(r"(?<!coupling )agent$|^(?:halide|fluoride) source$|^(?:nucleophile|oxidant|reductant|metal|diol)$")
"""Roles of the reagents that make a reaction what it is."""
SHARED_REAGENTS = 2
"""Number of reagents of the nearest protocol that a text without words for a reaction must name to be taken for it."""
CANDIDATES = 4
"""Number of kinds of reaction that are tried on a text, best first."""
SOLVENT_ROLES = ("solvent", "co-solvent", "alcohol and solvent", "base and solvent")
PURIFICATIONS = {
    "Recrystallize": "recrystallization",
    "Chromatograph": "column chromatography",
    "Distill": "distillation",
}
DECISIVE = (
    *("oxidizer", "reducing_agent", "chlorinating_agent", "brominating_agent", "halogenating_agent", "acylating_agent"),
    *("alkylating_agent", "organometallic", "active_metal", "halogen", "azide", "cyanide", "sulfonylating_agent"),
    *("silylating_agent", "coupling_agent", "organic_reagent", "lewis_acid"),
)
"""Categories of reagents that determine the reaction."""


class TemplateWriter:
    """Writes protocols without a language model; the same text gives the same protocol."""

    def write(self, commission: Commission) -> WriterResult:
        """Return a protocol whose names, amounts and conditions come from the text, else from the table.

        A reaction without a template is taken from the library of experiments.

        Raises:
            RefusalError: no kind of reaction fits the text, no vessel or bath is suitable, or reagents must not meet.
        """
        description = commission.description
        _refuse_nothing(description)
        unwritten = transformations().unwritten.first_in(description.text)
        if unwritten:
            return from_library(commission, unwritten)
        first: RefusalError | None = None
        for kind in _kinds(description, commission.context, commission.catalog):
            try:
                return _written(kind, commission)
            except RefusalError as refusal:
                if refusal.reason != "no-reaction":
                    raise first or refusal from None
                first = first or refusal
        if first is not None:
            raise first
        _refuse_purification(description)
        examples = ", ".join(sorted(other.name for other in transformations().transformations)[:6])
        raise RefusalError(
            "no-reaction", f"no reaction is recognized in the text; templates are for example: {examples}"
        )


def _written(kind: Transformation, commission: Commission) -> WriterResult:
    """Return the protocol of one kind of reaction.

    Raises:
        RefusalError: the text does not fit the kind, or cannot be carried out.
    """
    description, catalog = commission.description, commission.catalog
    kind = with_own_reagents(kind, description.reagents, catalog)
    before, after = parted(kind, description.clauses, catalog)
    assignment = cast(kind, before, catalog)
    parts = assignment.parts
    _refuse_mismatch(kind, parts, catalog)
    refuse_solvent([p.asset.name for p in parts], [p.asset.name for p in parts if p.role in SOLVENT_ROLES])
    builder = ProtocolBuilder(catalog)
    reaction = ReactionWriter(builder, kind, commission, before, parts)
    reaction.carry_out()
    mixture = ReactionMixture.of(parts, reaction.hottest, reaction.vessel, reaction.volume, kind.action == "Distill")
    work_up = WorkUp(builder, kind, mixture, assignment.factor)
    for step in work_up_steps(kind, after, mixture, catalog):
        work_up.carry_out(step)
    _analyze(builder, kind, after)
    clean_up(builder)
    weigh_first(builder, reaction.vessel)
    refuse_mixture(use.name for use in builder.reagents)
    assumed = [*dict.fromkeys(work_up.assumed)]
    if assumed:
        builder.notes.append(f"work-up completed with: {', '.join(assumed)}")
    builder.notes[:0] = _assumptions(kind, parts)
    protocol = derive(fitted(_protocol(description, kind, builder, parts), catalog), catalog)
    return WriterResult(protocol, tuple(builder.notes))


def _refuse_nothing(description: ParsedDescription) -> None:
    """Raise an error unless a description names a substance.

    Raises:
        RefusalError: it names no substance.
    """
    if not any(m.kind in ("reagent", "class") for clause in description.clauses for m in clause.mentions):
        raise RefusalError("no-chemistry", "the text names no substance of the catalog: say what reacts with what")


def _refuse_purification(description: ParsedDescription) -> None:
    """Raise an error if a description contains only a purification.

    Raises:
        RefusalError: it describes only a purification.
    """
    purifying = [c.operation.action for c in description.clauses if c.operation and c.operation.phase == "purification"]
    if purifying:
        action = PURIFICATIONS.get(purifying[0], purifying[0].lower())
        message = f"the text describes a {action} alone; a protocol needs a reaction of one of the seven types"
        raise RefusalError("no-reaction", f"{message}: describe how the crude product is made")


def _kinds(description: ParsedDescription, context: SearchResults, catalog: Catalog) -> tuple[Transformation, ...]:
    """Return the kinds of reaction that the text may mean, best first; else that of the nearest protocol.

    A text that names a reaction means no other. A reagent of the user counts as its classes of substances if the text
    is not recognized without it.
    """
    own = own_reagents(description.reagents, catalog)
    classes = frozenset[str]().union(*map(classes_of, own))
    kinds = recognize(description.spoken_of) or recognize(description.spoken_of | classes)
    firm = recognize(description.reacting)
    kinds = tuple(kind for kind in kinds if not firm or kind in firm or _brings_its_reagents(kind, description))
    if kinds:
        signed = tuple(kind for kind in kinds if not description.spoken_of.isdisjoint(kind.signs))
        return signed[:CANDIDATES] or tuple(dict.fromkeys((*kinds[:CANDIDATES], *_supplied(description))))
    named = {m.name for clause in description.clauses for m in clause.mentions if m.kind in ("reagent", "class")}
    for hit in context.hits:
        for other in transformations().transformations:
            slots = {name for slot in other.slots for name in (slot.asset, *slot.accepts)}
            if other.like == hit.fragment.source and len(slots & named) >= SHARED_REAGENTS:
                return tuple(dict.fromkeys((other, *_supplied(description))))
    return tuple(_supplied(description))


def _supplied(description: ParsedDescription) -> Iterator[Transformation]:
    """Yield the kinds of reaction for whose every slot a text names another reagent."""
    for kind in transformations().transformations:
        free = list(description.reagents)
        for slot in kind.slots:
            match = next((name for name in free if name == slot.asset or name in slot.accepts), None)
            if match is None:
                break
            free.remove(match)
        else:
            yield kind


def _brings_its_reagents(kind: Transformation, description: ParsedDescription) -> bool:
    """Return whether a text names the reagents that a kind of reaction needs in addition to its substrates and helpers.

    A kind that only the name of the product suggests does not count without them.
    """
    decisive = [slot for slot in kind.slots if _AGENT.search(slot.role)]
    named = set(description.reagents)
    return all(not named.isdisjoint((slot.asset, *slot.accepts)) for slot in decisive)


def _refuse_mismatch(kind: Transformation, parts: Sequence[Participant], catalog: Catalog) -> None:
    """Raise an error unless the participants fit the kind of reaction.

    Raises:
        RefusalError: the text names a decisive reagent that the reaction does not use, and a required one is missing.
    """
    roles = {slot.role for slot in kind.slots}
    extra = [p.asset for p in parts if p.when == "add" and p.role not in roles]
    strange = [
        asset.name
        for asset in extra
        if asset.category in DECISIVE or asset.name == "Hydrogen" or asset.name in catalog.own
    ]
    missing = [p.asset.name for p in parts if not p.named and p.role in roles and p.asset.category in DECISIVE]
    if strange and missing:
        message = f"no template uses {strange[0]} as the text does; the nearest, {kind.name!r}, takes {missing[0]}"
        raise RefusalError("no-reaction", message)


def _analyze(builder: ProtocolBuilder, kind: Transformation, clauses: Sequence[Clause]) -> None:
    catalog = builder.catalog
    names = dict.fromkeys(name for clause in clauses for name in clause.names("instrument"))
    devices = [name for name in names if catalog.get(name).category == "analytical"] or [kind.analysis]
    tube = ("NMRTube",) if any("NMR" in name for name in devices) else ()
    words = " and ".join(short_name(name, catalog) for name in devices)
    builder.do("Analyze", f"Check the identity and purity of the product ({words}).", device=(*devices, *tube))


def _assumptions(kind: Transformation, parts: Sequence[Participant]) -> list[str]:
    notes = [f"{p.asset.name} stands in for the {p.stands_for} of the text" for p in parts if p.stands_for]
    notes.append(f"written as: {kind.name} (template {kind.id}, like {kind.like})")
    unnamed = [part.asset.name for part in parts if not part.named]
    if unnamed:
        notes.append(f"not named in the text and assumed: {', '.join(unnamed)}")
    return notes


def _protocol(
    description: ParsedDescription, kind: Transformation, builder: ProtocolBuilder, parts: Sequence[Participant]
) -> Protocol:
    digest = hashlib.sha256(description.text.encode()).hexdigest()[:10]
    product = stated_product(kind, description.product, description.requested, parts)
    stand_ins = "".join(f" {p.asset.name} stands in for the {p.stands_for}." for p in parts if p.stands_for)
    return Protocol(
        id=f"{kind.id}-{digest}",
        name=kind.name,
        reaction_type=kind.type,
        product=product,
        description=f"{kind.name}, giving {product}.{stand_ins} Written from the text: {description.text[:1000]}",
        reagents=builder.reagents,
        instruments=builder.instruments,
        steps=tuple(builder.steps),
    )


def from_library(commission: Commission, name: str) -> WriterResult:
    """Return the first experiment of a named reaction that keeps every statement of the text, as a protocol.

    Args:
        name: name of the reaction as written: "Swern".

    Raises:
        RefusalError: the library has no such experiment, or those that it has differ from the text; names them.
    """
    differences: list[str] = []
    for experiment in _experiments_of(name):
        try:
            protocol = stage(_scaled(experiment, commission), commission.catalog)
        except LabgymError:
            continue
        lost = tuple(dict.fromkeys(unkept(commission.description, protocol, commission.catalog)))
        if not lost:
            digest = hashlib.sha256(commission.text.encode()).hexdigest()[:10]
            text = f"{protocol.description} Chosen for the text: {commission.text[:1000]}"
            chosen = protocol.model_copy(update={"id": f"{protocol.id[:53]}-{digest}", "description": text})
            note = f"staged from the experiment {experiment.id} of the library: {experiment.name}"
            return WriterResult(chosen, (note, "its amounts and conditions are those of the library"))
        differences.append(f"{experiment.id} ({experiment.name}), which has no {' or '.join(map(repr, lost[:3]))}")
    if differences:
        message = f"there is no template for {name!r}; the library has {'; '.join(differences[:2])}"
        raise RefusalError("no-reaction", f"{message}: take it as it is with labgym protocols stage")
    raise RefusalError("no-reaction", f"neither a template nor an experiment exists for a reaction called {name!r}")


def _scaled(experiment: Experiment, commission: Commission) -> Experiment:
    """Return an experiment at the size that the text's first amount of one of its reagents gives it."""
    amounts = {portion.name: portion.amount for action in experiment.actions for portion in action.takes}
    for clause in commission.description.clauses:
        for name, amount in clause.amounts.items():
            if name not in amounts or name not in commission.catalog:
                continue
            asset = commission.catalog.get(name)
            ours, theirs = moles_of(asset, amount), moles_of(asset, amounts[name])
            if ours and theirs:
                return _resized(experiment, ours / theirs)
    return experiment


def _resized(experiment: Experiment, factor: float) -> Experiment:
    actions = [
        action.model_copy(
            update={
                "takes": tuple(
                    portion.model_copy(update={"amount": scaled(portion.amount, factor)}) for portion in action.takes
                )
            }
        )
        for action in experiment.actions
    ]
    return experiment.model_copy(update={"actions": tuple(actions)})


def _experiments_of(name: str) -> Iterator[Experiment]:
    word = name.lower().split()[0]
    for experiment in experiments().values():
        names = " ".join((experiment.id, experiment.name, *experiment.synonyms)).lower()
        if word in names or name.lower() in names:
            yield experiment
