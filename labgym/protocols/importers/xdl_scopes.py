"""Names in XDL: parameters, the arguments of blueprints, and the variables of repeats."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple
from xml.etree.ElementTree import Element

MAX_BLUEPRINTS = 20
"""Deepest nesting of blueprints."""


class Member(NamedTuple):
    """A reagent or a vessel: its name, "Reagent" or "Hardware", and its attributes."""

    name: str
    kind: str
    attributes: Mapping[str, str]

    def has(self, key: str, value: str) -> bool:
        """Return whether it is of a kind, or has an attribute of a value; a missing attribute is false."""
        return self.kind == value if key == "kind" else self.attributes.get(key, "false").lower() == value.lower()


@dataclass(frozen=True)
class Scope:
    """The names that the steps of a synthesis, of a blueprint or of a repeat may use.

    Attributes:
        values: values by name, of parameters, arguments and variables.
        members: its reagents and vessels.
        depth: number of blueprints around it.
    """

    values: ChainMap[str, str]
    members: tuple[Member, ...]
    depth: int = 0

    @classmethod
    def of(cls, element: Element, arguments: Mapping[str, str], depth: int = 0) -> Scope:
        """Return the scope of a Synthesis, or of a Blueprint with the arguments of the step that calls it."""
        values, members = dict[str, str](), list[Member]()
        for parameter in element.iterfind("Parameters/Parameter"):
            name = parameter.get("id", "")
            values[name] = arguments.get(name, parameter.get("value", ""))
        for path, kind in (("Reagents/Reagent", "Reagent"), ("Hardware/Component", "Hardware")):
            for item in element.iterfind(path):
                name = item.get("name") or item.get("id") or ""
                values[name] = arguments.get(name) or arguments.get(item.get("id", ""), name)
                members.append(Member(values[name], kind, item.attrib))
        return cls(ChainMap(values), tuple(members), depth)

    def resolved(self, step: Element) -> Element:
        """Return a step with names replaced by their values; `param.time` is the attribute `time` of a parameter."""
        attributes = {key.removeprefix("param."): self.values.get(value, value) for key, value in step.items()}
        return Element(step.tag, attributes)

    def iterations(self, repeat: Element) -> Iterator[Scope]:
        """Yield a scope for each combination of the reagents or vessels that the variables of a repeat stand for.

        `rx.role="substrate"` makes the variable rx stand for each substrate in turn; several conditions narrow it down.
        """
        conditions: dict[str, list[tuple[str, str]]] = {}
        for key, value in repeat.items():
            variable, dot, name = key.partition(".")
            if dot:
                conditions.setdefault(variable, []).append((name, value))
        choices = [
            [(variable, member.name) for member in self.members if all(member.has(*pair) for pair in pairs)]
            for variable, pairs in conditions.items()
        ]
        for chosen in product(*choices):
            yield Scope(self.values.new_child(dict(chosen)), self.members, self.depth)
