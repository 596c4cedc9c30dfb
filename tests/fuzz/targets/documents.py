"""JSON documents: one target for each kind, with the files of the repository or a sample of the schema."""

from __future__ import annotations

import importlib
import json
import pkgutil
import re
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import Any

from floor_shapes import two_rooms

import labgym
from fuzz.mutation import mutated_json
from fuzz.target import Case, Target
from labgym.documents import Document
from labgym.envs.labnav.pack import FloorPack
from labgym.eval.leaderboard.receipts import PASSED, FreshReceipt
from labgym.layouts import Layout, load_published, published
from labgym.layouts.rules import PAPER
from labgym.layouts.sites import FloorFile
from labgym.layouts.trace import Recorder, Trace

PACKAGED = re.compile(
    r"labgym\.(assets\.(?!catalog|forge)|layouts\.(habits|splits)|protocols\.(synthesis|refusals|language)|eval\.reports)"
)
"""Documents that labgym reads from its own package only."""


@cache
def kinds() -> dict[str, type[Document]]:
    """Return every document of labgym by the path of its class."""
    for module in pkgutil.walk_packages(labgym.__path__, "labgym."):
        source = Path(module.module_finder.path) / f"{module.name.rpartition('.')[2]}.py"
        if source.is_file() and re.search(r"\bSCHEMA: ClassVar", source.read_text()):
            importlib.import_module(module.name)
    found = {f"{kind.__module__}.{kind.__name__}": kind for kind in _subclasses(Document)}
    return {
        name: kind for name, kind in sorted(found.items()) if name.startswith("labgym.") and hasattr(kind, "SCHEMA")
    }


def targets() -> Iterator[Target]:
    """Yield a target for each kind of document."""
    for name, kind in kinds().items():
        share = 0.25 if PACKAGED.match(name) else 0.5
        yield Target(
            f"document {name.removeprefix('labgym.')}",
            partial(_prepare, kind),
            partial(_read, kind),
            ("fuzz.seeds",),
            share=share,
        )


def _prepare(kind: type[Document]) -> Callable[[Random | None], Case]:
    from fuzz.seeds import SEEDS

    seeds = [data for data in SEEDS.get(kind.SCHEMA, []) if _fits(kind, data)]
    if kind is Layout:
        old = load_published("val", published("val")[0])
        rooms = Layout(id="rooms", floor=two_rooms(), placements=old.placements[:2])
        seeds = [old.to_json(), rooms.to_json()]
    if kind is Trace:
        recorder = Recorder()
        recorder.begin(Layout(id="rooms", floor=two_rooms(), placements=()), None, PAPER)
        seeds = [recorder.trace().to_json()]
    if kind is FloorFile:
        seeds = [FloorFile(**two_rooms().model_dump()).to_json()]
    if kind is FloorPack:
        seeds = [{**_sample_of(kind), "floors": ["floors/00000.json.gz"], "episodes": {"aisle-2": [2]}}]
    if kind is FreshReceipt and not seeds:
        seeds = [{**_sample_of(kind), "verdict": PASSED}]  # as its gain says
    seeds = [_trimmed(kind, data) for data in seeds] or [_sample_of(kind)]

    def make(rng: Random | None) -> Case:
        return {"a.json": json.dumps(seeds[0]).encode() if rng is None else mutated_json(rng, rng.choice(seeds))}

    return make


def _read(kind: type[Document], folder: Path) -> None:
    document = kind.load(folder / "a.json")
    json.dumps(document.to_json())
    for derived in ("hash", "digest", "label", "shards"):
        getattr(document, derived, None)


def _fits(kind: type[Document], data: Any) -> bool:
    """Return whether data are of this kind: two kinds may have one schema."""
    try:
        kind.parse(data)
    except ValueError:
        return False
    return True


def _trimmed(kind: type[Document], data: dict[str, Any]) -> dict[str, Any]:
    """Return a document with the first items of each list and object, if that is valid: mutations are then quick."""
    for most in (2, 4, 16):
        short: dict[str, Any] = _first(data, most, 0)
        if _fits(kind, short):
            return short
    return data


def _first(data: Any, most: int, depth: int) -> Any:
    if isinstance(data, list):
        return [_first(item, most, depth + 1) for item in data[:most]]
    if isinstance(data, dict):
        items = list(data.items())[: 60 if depth < 3 else 20]
        return {key: _first(item, most, depth + 1) for key, item in items}
    return data


def _sample_of(kind: type[Document]) -> dict[str, Any]:
    schema = kind.model_json_schema()
    return {"schema": kind.SCHEMA, **_sample(schema, schema.get("$defs", {}))}


def _sample(schema: dict[str, Any], definitions: dict[str, Any]) -> Any:
    """Return the smallest data that a JSON Schema of pydantic describes, with one item in each list and mapping."""
    if "$ref" in schema:
        return _sample(definitions[schema["$ref"].rpartition("/")[2]], definitions)
    if "const" in schema or "enum" in schema:
        return schema.get("const", (schema.get("enum") or [None])[0])
    for choice in ("anyOf", "oneOf", "allOf"):
        if choice in schema:
            return _sample(schema[choice][0], definitions)
    match schema.get("type"):
        case "object":
            wanted = schema.get("properties", {})
            data = {name: _sample(part, definitions) for name, part in wanted.items() if "default" not in part}
            more = schema.get("additionalProperties")
            return data | ({"a": _sample(more, definitions)} if isinstance(more, dict) else {})
        case "array":
            if "prefixItems" in schema:
                return [_sample(part, definitions) for part in schema["prefixItems"]]
            return [_sample(schema.get("items", {}), definitions)] * max(1, schema.get("minItems", 1))
        case "string":
            return "a" * 64 if "{64}" in schema.get("pattern", "") else "a" * max(1, schema.get("minLength", 1))
        case "integer":
            return int(schema.get("minimum", schema.get("exclusiveMinimum", 0) + 1))
        case "number":
            return float(schema.get("minimum", schema.get("exclusiveMinimum", 0.0) + 0.5))
        case "boolean":
            return False
    return None


def _subclasses(kind: type[Document]) -> Iterator[type[Document]]:
    for each in kind.__subclasses__():
        yield each
        yield from _subclasses(each)
