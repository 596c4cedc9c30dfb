"""Answers of a language model that describe an existing layout, and a request to test with."""

from __future__ import annotations

import json
import math
import random
from typing import Any

from labgym.layouts import Layout
from labgym.layouts.generate import resolve_request
from labgym.layouts.placement import FLOOR
from labgym.layouts.request import Request


def request_for(protocol: str = "alk_03", seed: int = 3, **options: Any) -> Request:
    """Return a request for a protocol of the library."""
    settings: dict[str, Any] = {"room": None, "profile": "default", "catalog": None, "fixed": ()}
    return resolve_request(protocol, seed, **{**settings, **options})


def room_answer(layout: Layout) -> dict[str, Any]:
    """Return the answer at room level that describes a layout; all its furniture is in the zone `reaction`."""
    furniture = [
        {
            "asset": placement.asset,
            "zone": "reaction",
            "x": placement.position[0],
            "y": placement.position[1],
            "yaw": math.degrees(placement.yaw),
            "holds": [child.id for child in layout.children(placement.id)],
        }
        for placement in layout.placements
        if placement.support == FLOOR
    ]
    zone = {"name": "reaction", "space": layout.floor.spaces[0].id, "x0": 0.5, "y0": 1.0, "x1": 5.0, "y1": 6.0}
    count = len(layout.protocols[0].steps)
    steps = [{"step": number, "zone": "reaction"} for number in range(1, count + 1)]
    return {"refusal": "", "zones": [zone], "furniture": furniture, "steps": steps}


def surface_answer(layout: Layout, carrier: str) -> dict[str, Any]:
    """Return the answer about a piece of furniture, in the frame of a person in front of each surface."""
    items = []
    for child in layout.children(carrier):
        surface = layout.surface(carrier, child.slot or 0)
        x, y = surface.to_local(child.position[0], child.position[1])
        items.append(
            {
                "id": child.id,
                "surface": child.slot,
                "x": surface.width / 2.0 - x,
                "y": surface.depth / 2.0 - y,
                "yaw": math.degrees(math.remainder(child.yaw - surface.yaw, math.tau)),
            }
        )
    return {"items": items}


def conversation(layout: Layout) -> list[str]:
    """Return the replies that describe a layout, in the order in which they are requested."""
    carriers = [p.id for p in layout.placements if p.support == FLOOR and layout.children(p.id)]
    return [json.dumps(room_answer(layout)), *(json.dumps(surface_answer(layout, each)) for each in carriers)]


def random_answer(schema: dict[str, Any], draw: random.Random, most: int = 30) -> Any:
    """Return a random value that a closed JSON Schema allows; numbers are often at their bounds."""
    definitions = schema.get("$defs", {})

    def value(part: dict[str, Any]) -> Any:
        if "$ref" in part:
            return value(definitions[part["$ref"].rpartition("/")[2]])
        if "anyOf" in part:
            return value(draw.choice(part["anyOf"]))
        if "const" in part:
            return part["const"]
        if "enum" in part:
            return draw.choice(part["enum"])
        if part["type"] == "object":
            return {name: value(each) for name, each in part["properties"].items()}
        if part["type"] == "array":
            return [value(part["items"]) for _ in range(draw.randint(0, min(part["maxItems"], most)))]
        if part["type"] == "integer":
            return draw.randint(part["minimum"], part["maximum"])
        if part["type"] == "number":
            low, high = part["minimum"], part["maximum"]
            return draw.choice([low, high, draw.uniform(low, high)])
        return ""

    return value(schema)


def answers_at_random(loopback: Any, seed: int) -> None:
    """Let a loopback server answer every request at random, within the schema that the request names."""
    draw = random.Random(seed)

    def answer(handler: Any) -> None:
        schema = loopback.requests[-1]["response_format"]["json_schema"]["schema"]
        loopback.says(json.dumps(random_answer(schema, draw)))
        loopback.script.pop()(handler)

    loopback.does(answer)
