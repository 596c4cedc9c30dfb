"""All loaders under test."""

from __future__ import annotations

from fuzz.targets import documents, exchange, meshes, networks, reactions, robots, runs, settings, wire

TARGETS = tuple(
    target
    for module in (documents, exchange, reactions, meshes, robots, runs, settings, wire, networks)
    for target in module.targets()
)
