"""Procedures: a text of several sentences becomes a laboratory's protocol by way of its action list.

A wish in one line is the business of `labgym.protocols.synthesis.synthesize`; `is_procedure` tells them apart.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from labgym.assets import Catalog
from labgym.protocols.amounts import read_amount
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments.model import Action, Experiment, Material, Portion
from labgym.protocols.language import language_of
from labgym.protocols.model import Protocol
from labgym.protocols.reading.actions import ActionList
from labgym.protocols.reading.figures import figures, plain
from labgym.protocols.reading.reader import REACTING, read_procedure
from labgym.protocols.reading.tokens import sentences
from labgym.protocols.refusals import (
    is_ordinary_dinitro,
    refuse_product,
    refuse_structures,
    refuse_to_make,
    refuse_wish,
)
from labgym.protocols.substances import Resolver
from labgym.protocols.synthesis.staging import stage
from labgym.protocols.synthesis.synthesis import INCOMPATIBLE
from labgym.protocols.validate import ProtocolError, examine

LONGEST_WISH = 500
"""Characters up to which a text may be a wish that a template fulfills."""
LEAST_SENTENCES, LEAST_AMOUNTS = 2, 2
"""Sentences and amounts that make a text a procedure."""
MAX_LACKS = 90
"""Most reasons that a partial protocol carries."""
UNNAMED = "a product that the text does not name"
_QUANTITIES = ("mass", "volume", "substance", "parts")
_PARTS = re.compile(r"(?<![\d.])(\d{1,9}(?:\.\d{1,9})?) parts\b")


@dataclass(frozen=True)
class Compilation:
    """The result of compiling a procedure.

    Attributes:
        actions: as read.
        protocol: None if something is lacking and a partial protocol was not asked for.
        lacks: what the protocol does not carry over from the text, or what no one can tell from it, a sentence each.
        notes: assumptions, one sentence each.
        advice: of the examination.
    """

    actions: ActionList
    protocol: Protocol | None
    lacks: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    advice: tuple[str, ...] = ()


def is_procedure(text: str) -> bool:
    """Return whether a text has several sentences with amounts, so that it is read rather than matched to a template.

    A short text may still be a wish in two sentences.
    """
    if language_of(text) != "en":
        return False
    simple = plain(text)
    numbers = figures(simple)
    amounts = sum(number.kind in _QUANTITIES for number in numbers)
    return amounts >= LEAST_AMOUNTS and len(sentences(simple, numbers)) >= LEAST_SENTENCES


def compile_procedure(text: str, partial: bool = False, names: Resolver | None = None) -> Compilation:
    """Read a procedure and stage it as a protocol that embeds the substances that the catalog lacks.

    Args:
        text: in English.
        partial: whether a protocol is written although something is lacking; it names what in its `partial`.
        names: says what the names mean; by default with all sources that are installed.

    Raises:
        RefusalError: the text asks for something dangerous, or equipment and reagents do not suffice.
        ProtocolError: the protocol breaks rules.
        OptionError: the text is too long.
    """
    refuse_wish(text)
    refuse_structures(text)
    actions = read_procedure(text)
    resolver = names if names is not None else Resolver(Catalog.load())
    experiment, notes, lacks = prepared(actions)
    _refuse_products(actions, experiment, resolver)
    if experiment is None or (lacks and not partial):
        return Compilation(actions, None, lacks, notes)
    protocol = stage(experiment, names=resolver, partial=lacks[:MAX_LACKS])
    if lacks:
        _refuse_unread(actions, experiment, resolver)
    if protocol.partial and not partial:
        return Compilation(actions, None, protocol.partial, notes)
    advice = tuple(f"{finding.message}; {finding.suggestion}" for finding in examine(protocol))
    return Compilation(actions, protocol, protocol.partial, notes, advice)


def prepared(actions: ActionList) -> tuple[Experiment | None, tuple[str, ...], tuple[str, ...]]:
    """Return an action list as an experiment, with the assumptions that were made and what it lacks of the text.

    Without a material that is added there is no experiment.
    """
    notes: list[str] = []
    lacks = list(_unread(actions))
    listed = list(_written_out(actions.actions, lacks))
    listed = _with_collected(_with_layers(listed))
    listed = _dried(_weighed_parts(listed, notes), notes)
    if not any(action.takes for action in listed):
        return None, tuple(notes), (*lacks, "the text names no material that is added: say what reacts with what")
    if listed[-1].verb in REACTING or not actions.product:
        notes.append("the text does not name what is isolated")
    if actions.outcome == "partial" and not lacks:
        lacks.append(
            "the text does not tell the whole procedure: amounts before the work-up, or the product, are missing"
        )
    taken = dict.fromkeys(portion.name for action in listed for portion in action.takes)
    experiment = Experiment(
        id=f"procedure_{hashlib.sha256(actions.text.encode()).hexdigest()[:12]}",
        name=actions.product[:300] or UNNAMED,
        product=actions.product or UNNAMED,
        description=actions.text[:4000],
        materials=tuple(Material(name=name, role=actions.roles.get(name, "reagent")) for name in taken),
        actions=tuple(listed),
        origin="text",
    )
    return experiment, tuple(notes), tuple(dict.fromkeys(line[:500] for line in lacks))


def _unread(actions: ActionList) -> Iterator[str]:
    """Yield a sentence for each span that no action owns, with the words around it."""
    for item in actions.unread:
        around = " ".join(actions.text[max(0, item.start - 25) : item.end + 25].split())
        yield f"unread: {item.text[:80]!r} in \u201c{around[:140]}\u201d ({item.why})"


def _written_out(actions: Sequence[Action], lacks: list[str]) -> Iterator[Action]:
    """Yield the actions without references; a repeat of the action before it is that action once more."""
    last: Action | None = None
    for action in actions:
        if action.verb == "Refers":
            lacks.append(
                f"the text refers to another procedure ({action.note[:80] or 'unnamed'}): write its actions out"
            )
        elif action.verb == "Repeat" and last is not None and _is_repeatable(last, action):
            again = last.model_copy(update={"takes": action.takes or last.takes})
            for _ in range(action.repeats):
                yield again
        elif action.verb == "Repeat":
            lacks.append(f"the text repeats earlier actions ({action.note[:80]}): write them out")
        else:
            last = _counted(action)
            yield last


def _counted(action: Action) -> Action:
    """Return an action with the number of times in its note, unless its amounts state it ("3 x 20 mL")."""
    if action.repeats == 1 or any(" x " in portion.amount for portion in action.takes):
        return action
    return action.model_copy(update={"note": "; ".join(filter(None, (action.note, f"{action.repeats} times")))[:400]})


def _is_repeatable(last: Action, repeat: Action) -> bool:
    """Return whether a repeat is of the last action alone, a number of times."""
    alone = last.verb in ("Wash", "Extract", "Triturate", "Recrystallize", "Concentrate", "Partition")
    return alone and bool(last.takes) and " until " not in f"{repeat.note} "


def _dried(actions: Sequence[Action], notes: list[str]) -> list[Action]:
    """Return the actions with a drying, which is assumed, of a wet organic layer that is distilled later."""
    listed = list(actions)
    wet: int | None = None
    for place, action in enumerate(actions):
        if action.verb in ("Extract", "Wash", "Partition"):
            wet = place
        elif action.verb in ("DrySolution", "DrySolid", "Quench", "AdjustPH", "Crystallize", "Chromatograph"):
            wet = None
        elif action.verb == "Distill" and wet is not None:
            portion = Portion(name="magnesium sulfate", assumed=True)
            drying = Action(verb="DrySolution", takes=(portion,), note="assumed", assumed=("verb",))
            notes.append("the organic layer is dried with magnesium sulfate before it is distilled")
            return [*listed[: wet + 1], drying, *listed[wet + 1 :]]
    return listed


def _with_layers(actions: Sequence[Action]) -> list[Action]:
    """Return the actions with collected layers as what the separation before them keeps, or as separations.

    "Quenched. Acetic acid was added" is a quench with acetic acid.
    """
    listed: list[Action] = []
    for action in actions:
        last = listed[-1] if listed else None
        if last is not None and last.verb in ("Quench", "AdjustPH") and not last.takes and _is_addition(action):
            listed[-1] = last.model_copy(update={"takes": action.takes, "part": action.part})
        elif action.verb != "CollectLayer":
            listed.append(action)
        elif last is not None and last.verb in ("Extract", "PhaseSeparation", "Partition", "Wash") and not last.keep:
            listed[-1] = last.model_copy(update={"keep": action.keep or action.part})
        else:
            listed.append(action.model_copy(update={"verb": "PhaseSeparation"}))
    return listed


def _is_addition(action: Action) -> bool:
    return action.verb in ("Add", "Pour") and bool(action.takes)


def _with_collected(actions: Sequence[Action]) -> list[Action]:
    """Return the actions with the products, as the text weighs them, in the note of the analysis that follows.

    A transfer goes into the note of the action that follows it.
    """
    listed: list[Action] = []
    said: list[str] = []
    for action in actions:
        if action.verb == "Yield":
            said += [f"collected: {item.name} {item.amount}".strip() for item in action.gives]
        elif action.verb == "Transfer" and not action.takes:
            said.append(f"first transfer it to {action.vessel or 'another vessel'}")
        else:
            note = "; ".join(filter(None, (action.note, *said)))
            listed.append(action.model_copy(update={"note": note[:400]}))
            said = []
    if said:
        listed.append(Action(verb="Analyze", note="; ".join(said)[:400], assumed=("verb",)))
    return listed


def _weighed_parts(actions: Sequence[Action], notes: list[str]) -> list[Action]:
    """Return the actions with parts by weight as grams; parts of a ratio of solvents become words.

    Old patents weigh everything in parts. Parts of a mixture of solvents alone have no size.
    """
    portions = [portion for action in actions for portion in action.takes]
    by_weight = [portion for portion in portions if _PARTS.search(portion.amount)]
    if not by_weight:
        return list(actions)
    whole = len(by_weight) >= 3 and all(not read_amount(_PARTS.sub("", item.amount)).mass for item in portions)
    if whole:
        notes.append("1 part is taken as 1 g")

    def converted(portion: Portion) -> Portion:
        if whole:
            return portion.model_copy(update={"amount": _PARTS.sub(r"\1 g", portion.amount)})
        rest = ", ".join(part for part in portion.amount.split(", ") if not _PARTS.fullmatch(part))
        return portion.model_copy(update={"amount": rest})

    listed = []
    for action in actions:
        ratio = [f"{item.amount} of {item.name}" for item in action.takes if _PARTS.search(item.amount)]
        words = ", ".join(ratio) if ratio and not whole else ""
        note = "; ".join(filter(None, (action.note, words)))[:400]
        listed.append(action.model_copy(update={"takes": tuple(map(converted, action.takes)), "note": note}))
    return listed


def _refuse_products(actions: ActionList, experiment: Experiment | None, resolver: Resolver) -> None:
    """Raise an error if a text names what must not be made, other than as a reagent that is sold and that it takes.

    Raises:
        RefusalError: names the substance and the reason.
    """
    known: set[str] = set()
    if experiment is not None:
        named = resolver.resolve(experiment.materials)
        known = {item.name for item in named if item.asset or (item.listed is not None and item.listed.sold)}
        known |= {item.name for item in named if not item.is_disputed and is_ordinary_dinitro(item.smiles)}
    used = [
        portion.span
        for action in actions.actions
        for portion in action.takes
        if portion.span is not None and portion.name in known
    ]
    refuse_product(actions.text, used)
    refuse_to_make(actions.product, actions.product)


def _refuse_unread(actions: ActionList, experiment: Experiment, resolver: Resolver) -> None:
    """Raise an error if a substance that no action owns would make the procedure dangerous, were it in the vessel.

    It is taken to be there from the sentence on that first names it.

    Raises:
        RefusalError: names the substances and the hazard.
    """
    phrases: list[tuple[int, int]] = []
    for item in sorted(actions.unread, key=lambda item: item.start):
        if item.why.startswith("name"):
            joins = phrases and item.start - phrases[-1][1] <= 1
            phrases[-1:] = [(phrases[-1][0], item.end)] if joins else [*phrases[-1:], (item.start, item.end)]
    taken = {material.name for material in experiment.materials}
    simple = plain(actions.text)
    begins = [part.tokens[0].start for part in sentences(simple, figures(simple)) if part.tokens]
    places = {
        actions.text[start:end][:200]: (max((at for at in begins if at <= start), default=0), end)
        for start, end in reversed(phrases)
    }
    words = dict.fromkeys(actions.text[start:end][:200] for start, end in phrases)
    named = resolver.resolve([Material(name=word, role="reagent") for word in words if word not in taken])
    known = tuple(item.name for item in named if item.asset or item.smiles)[:30]
    if not known:
        return
    materials = (*experiment.materials, *(Material(name=name, role="reagent") for name in known))
    present = [Action(verb="Add", takes=(Portion(name=name),), span=places[name]) for name in known]
    shadow = experiment.model_copy(
        update={"actions": tuple(_in_order(experiment.actions, present)), "materials": materials}
    )
    try:
        stage(shadow, names=resolver)
    except RefusalError as error:
        hazard = str(error)
    except ProtocolError as error:
        found = [item.message for item in error.findings if item.rule in INCOMPATIBLE]
        hazard = found[0] if found else ""
    else:
        return
    if hazard:
        listed = ", ".join(repr(name[:60]) for name in known[:5])
        raise RefusalError("unsafe", f"no action owns {listed}, and with it the procedure is dangerous: {hazard}")


def _in_order(actions: Sequence[Action], more: Sequence[Action]) -> Iterator[Action]:
    """Yield actions with more actions, each before the first that begins behind it in the text."""
    waiting = list(more)
    for action in actions:
        start = action.span[0] if action.span is not None else 0
        due = [item for item in waiting if item.span is not None and item.span[0] <= start]
        waiting = [item for item in waiting if item not in due]
        yield from due
        yield action
    yield from waiting
