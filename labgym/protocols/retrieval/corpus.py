"""What can be found: protocols, experiments and rules, cut into fragments that name their source."""

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
        origin: what the source is.
        kind: a card speaks of the whole, steps are those in a row at one place, actions are all of an experiment's, a
            rule is one.
        steps: first and last step that it covers, or None.
        title: name of the source.
        text: what it says, in English, with the Chinese names of what occurs in it on cards.
    """

    source: str
    origin: SourceKind
    kind: FragmentKind
    title: str
    text: str
    steps: tuple[int, int] | None = None

    @property
    def place(self) -> str:
        """Where it is from, for a reader: "pro_02, steps 3-5"."""
        if self.steps is None:
            return self.source
        first, last = self.steps
        return f"{self.source}, step {first}" if first == last else f"{self.source}, steps {first}-{last}"


@lru_cache(maxsize=1)
def corpus() -> tuple[Fragment, ...]:
    """Return the fragments of the published protocols, the experiment library and the segregation rules."""
    return (
        *fragments(protocols().values()),
        *experiment_fragments(experiments().values()),
        *_rule_fragments(),
    )


def fragments(library: Iterable[Protocol]) -> tuple[Fragment, ...]:
    """Return protocols cut into cards and runs of steps at one place."""
    found: list[Fragment] = []
    for protocol in library:
        found.append(Fragment(protocol.id, "protocol", "card", protocol.name, _card(protocol)))
        for _, run in groupby(protocol.steps, key=lambda step: step.location):
            steps = tuple(run)
            text = f"{protocol.name}. " + " ".join(_step_text(step) for step in steps)
            span = (steps[0].index, steps[-1].index)
            found.append(Fragment(protocol.id, "protocol", "steps", protocol.name, text, span))
    return tuple(found)


def experiment_fragments(library: Iterable[Experiment]) -> tuple[Fragment, ...]:
    """Return experiments cut into a card and their actions in words."""
    catalog = Catalog.published()
    found: list[Fragment] = []
    for item in library:
        names = "; ".join(f"{use.role} {_called(use.name, catalog)}" for use in item.materials)
        kind = (item.reaction_type or "").replace("_", " ")
        card = f"{item.name}. {'; '.join(item.synonyms)}. {kind}. {item.description} {item.product}. {names}."
        found.append(Fragment(item.id, "experiment", "card", item.name, card))
        found.append(Fragment(item.id, "experiment", "actions", item.name, f"{item.name}. {narrate(item, catalog)}"))
    return tuple(found)


def _called(name: str, catalog: Catalog) -> str:
    """Return the names that a search should find an asset by: two in English, one in Chinese."""
    if name not in catalog:
        return name
    asset = catalog.get(name)
    return " ".join((*asset.synonyms_en[:2], *asset.synonyms_zh[:1])) or name


def _card(protocol: Protocol) -> str:
    catalog = Catalog.load()
    names = [f"{use.role} {_called(use.name, catalog)}" for use in protocol.reagents]
    kind = protocol.reaction_type.replace("_", " ")
    synonyms = "; ".join(protocol.synonyms)
    return f"{protocol.name}. {synonyms}. {kind}. {protocol.description} {protocol.product}. {'; '.join(names)}."


def _step_text(step: Step) -> str:
    conditions = [f"{step.temperature:g} C"] if step.temperature is not None else []
    conditions += [f"{step.duration:g} min"] if step.duration is not None else []
    return f"{step.action}: {step.text} ({', '.join(conditions)})"


def _rule_fragments() -> tuple[Fragment, ...]:
    found = []
    for rule in rules("segregation"):
        sides = f"{', '.join(sorted(rule.a))} apart from {', '.join(sorted(rule.b))}".replace("_", " ")
        title = rule.kind.replace("_", " ")
        found.append(Fragment(rule.kind, "rule", "rule", title, f"Keep {sides}. {rule.hazard}"))
    return tuple(found)
