"""The searchable corpus: protocols, experiments and rules, cut into fragments that name their source."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import groupby
from typing import Literal

from labgym.assets import Catalog
from labgym.assets.compatibility import rules
from labgym.protocols.experiments import Experiment, experiments
from labgym.protocols.experiments.narration import narrate
from labgym.protocols.library import protocols
from labgym.protocols.model import Protocol, Step

FragmentKind = Literal["card", "steps", "actions", "rule"]
SourceKind = Literal["protocol", "experiment", "rule"]


@dataclass(frozen=True)
class Fragment:
    """A piece of the library.

    Attributes:
        source: id of the protocol or experiment, or kind of the rule.
        origin: kind of source.
        kind: "card" (summary of the whole), "steps" (consecutive steps at one place), "actions" (all actions of an
            experiment) or "rule".
        steps: first and last step that it covers, or None.
        title: name of the source.
        text: English text; cards also hold the Chinese names of the substances.
    """

    source: str
    origin: SourceKind
    kind: FragmentKind
    title: str
    text: str
    steps: tuple[int, int] | None = None

    @property
    def place(self) -> str:
        """Source as shown to a reader: "pro_02, steps 3-5"."""
        if self.steps is None:
            return self.source
        first, last = self.steps
        return f"{self.source}, step {first}" if first == last else f"{self.source}, steps {first}-{last}"


@lru_cache(maxsize=2)
def corpus(catalog: Catalog) -> tuple[Fragment, ...]:
    """Return the fragments of the published protocols, the experiment library and the segregation rules."""
    return (
        *fragments(protocols().values(), catalog),
        *experiment_fragments(experiments().values(), catalog),
        *_rule_fragments(),
    )


def fragments(library: Iterable[Protocol], catalog: Catalog) -> tuple[Fragment, ...]:
    """Return protocols cut into cards and runs of steps at one place."""
    pieces: list[Fragment] = []
    for protocol in library:
        pieces.append(Fragment(protocol.id, "protocol", "card", protocol.name, _card(protocol, catalog)))
        for _, run in groupby(protocol.steps, key=lambda step: step.location):
            steps = tuple(run)
            text = f"{protocol.name}. " + " ".join(_step_text(step) for step in steps)
            span = (steps[0].index, steps[-1].index)
            pieces.append(Fragment(protocol.id, "protocol", "steps", protocol.name, text, span))
    return tuple(pieces)


def experiment_fragments(library: Iterable[Experiment], catalog: Catalog) -> tuple[Fragment, ...]:
    """Return experiments cut into a card and their actions in words."""
    pieces: list[Fragment] = []
    for item in library:
        names = "; ".join(f"{use.role} {_search_names(use.name, catalog)}" for use in item.materials)
        kind = (item.reaction_type or "").replace("_", " ")
        card = f"{item.name}. {'; '.join(item.synonyms)}. {kind}. {item.description} {item.product}. {names}."
        pieces.append(Fragment(item.id, "experiment", "card", item.name, card))
        pieces.append(Fragment(item.id, "experiment", "actions", item.name, f"{item.name}. {narrate(item, catalog)}"))
    return tuple(pieces)


def _search_names(name: str, catalog: Catalog) -> str:
    """Return the names under which a search should find an asset: two in English, one in Chinese."""
    if name not in catalog:
        return name
    asset = catalog.get(name)
    return " ".join((*asset.synonyms_en[:2], *asset.synonyms_zh[:1])) or name


def _card(protocol: Protocol, catalog: Catalog) -> str:
    names = [f"{use.role} {_search_names(use.name, catalog)}" for use in protocol.reagents]
    kind = (protocol.reaction_type or "").replace("_", " ")
    synonyms = "; ".join(protocol.synonyms)
    return f"{protocol.name}. {synonyms}. {kind}. {protocol.description} {protocol.product}. {'; '.join(names)}."


def _step_text(step: Step) -> str:
    conditions = [f"{step.temperature:g} C"] if step.temperature is not None else []
    conditions += [f"{step.duration:g} min"] if step.duration is not None else []
    return f"{step.action}: {step.text} ({', '.join(conditions)})"


def _rule_fragments() -> tuple[Fragment, ...]:
    pieces = []
    for rule in rules("segregation"):
        sides = f"{', '.join(sorted(rule.a))} apart from {', '.join(sorted(rule.b))}".replace("_", " ")
        title = rule.kind.replace("_", " ")
        pieces.append(Fragment(rule.kind, "rule", "rule", title, f"Keep {sides}. {rule.hazard}"))
    return tuple(pieces)
