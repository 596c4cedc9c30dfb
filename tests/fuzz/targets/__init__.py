"""All loaders under test."""

from __future__ import annotations

from fuzz.targets import documents, exchange, labnav, meshes, networks, reactions, robots, runs, settings, wire

TARGETS = tuple(
    target
    for module in (documents, exchange, reactions, meshes, robots, runs, labnav, settings, wire, networks)
    for target in module.targets()
)
