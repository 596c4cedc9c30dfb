"""The released evaluator of LabBuilder by flags, in the literal mode: a second calculation that shares no code."""

from __future__ import annotations

import itertools
import math
from typing import Any

Data = dict[str, Any]
KINDS = (
    "ExperimentalPlatform", "ValidationPlatform", "FumeHood", "GloveBox", "ReagentCabinet", "RotaryEvaporator",
    "GravityChromatographyColumn",
)  # fmt: skip
SNAKE = {
    "experimental_platform": "ExperimentalPlatform",
    "validation_platform": "ValidationPlatform",
    "fume_hood": "FumeHood",
    "glove_box": "GloveBox",
    "reagent_cabinet": "ReagentCabinet",
}
DISTANCES = (
    ("C1", "flammable", "heat_source", 5),
    ("C5", "flammable", "oxidizer", 4),
    ("C6", "acid", "base", 4),
    ("C7", "oxidizer", "flammable", 3),
    ("C8", "reactive_metal", "acid", 2),
)
CATEGORIES = {"flam": ("C1",), "incomp": ("C5", "C6", "C7", "C8"), "store": ("C3",), "glass": ("C4",)}


def figures(scene: Data, assets: list[Data]) -> dict[str, float]:
    """Return counts and scores of a scene under the assets of a library.

    Args:
        scene: with `objects` as in the authors' files. assets: with `id`, `name`, `type`, `geometry` and `props`.
    """
    evaluator = _Evaluator(scene, assets)
    return {"obj": len(scene["objects"]), **evaluator.geometry(), **evaluator.chemistry()}


def curve(ratio: float) -> float:
    """Return how far a requirement is satisfied."""
    for bound, start, slope in ((0.9, 0.7, 3.0), (0.7, 0.2, 2.5), (0.0, 0.0, 0.3)):
        if ratio >= bound:
            return min(1.0, start + slope * (ratio - bound))
    raise ValueError(ratio)


class _Evaluator:
    def __init__(self, scene: Data, assets: list[Data]) -> None:
        self.assets, self.all = assets, scene["objects"]
        self.objects = [each for each in self.all if each["id"] != "LaboratoryRoom"]

    def asset(self, name: str) -> Data:
        base, _, number = name.rpartition("_")
        pascal = "".join(word.capitalize() for word in name.split("_"))
        exact = (name, base if number.isdigit() else name)
        for wanted in exact:
            for each in self.assets:
                if wanted in (each["id"], each["name"]):
                    return each
        for each in self.assets:
            if name.lower() in (each["id"].lower(), each["name"].lower()):
                return each
        return next((each for each in self.assets if pascal in (each["id"], each["name"])), {})

    def flag(self, item: Data, name: str) -> bool:
        return bool(self.asset(item["id"]).get("props", {}).get(name))

    def box(self, item: Data) -> tuple[float, ...]:
        sides = self.asset(item["id"]).get("geometry", {}).get("bbox", {"long": 0.1, "short": 0.1, "height": 0.2})
        width, depth, height = sides["long"], sides["short"], sides["height"]
        if item["rotation"]["z"] % 360 in (90, 270):
            width, depth = depth, width
        x, y, z = (item["position"][axis] for axis in "xyz")
        return x - width / 2, x + width / 2, y - depth / 2, y + depth / 2, z - height / 2, z + height / 2

    def on_floor(self, item: Data) -> bool:
        return item["initial_location"] == "floor" or item["id"] in KINDS

    def geometry(self) -> dict[str, float]:
        room = self.box(next(each for each in self.all if each["id"] == "LaboratoryRoom"))
        inside = (room[0] + 0.2, room[1] - 0.2, room[2] + 0.2, room[3] - 0.2)
        out = sum(self._out(each, inside) for each in self.objects)
        groups: dict[str | None, list[Data]] = {}
        for each in self.objects:
            groups.setdefault(None if self.on_floor(each) else each["initial_location"], []).append(each)
        colliding = sum(
            self._collide(one, other, name is None)
            for name, group in groups.items()
            for one, other in itertools.combinations(group, 2)
        )
        return {"ob": out, "cn": colliding, "heights": sum(map(self._misplaced, self.objects))}

    def _out(self, item: Data, inside: tuple[float, ...]) -> bool:
        if self.on_floor(item):
            return _beyond(self.box(item), inside) > 0.005
        surface = self._called(item["initial_location"], [each for each in self.objects if self.on_floor(each)])
        return surface is not None and _beyond(self.box(item), self.box(surface)) > 0.01

    def _called(self, label: str, candidates: list[Data]) -> Data | None:
        return next((each for each in candidates if SNAKE.get(label, label) == SNAKE.get(each["id"], each["id"])), None)

    def _collide(self, one: Data, other: Data, floor: bool) -> bool:
        a, b = self.box(one), self.box(other)
        if min(min(a[k + 1] - b[k], b[k + 1] - a[k]) for k in (0, 2, 4)) <= 0.05:
            return False
        area = (min(a[1], b[1]) - max(a[0], b[0])) * (min(a[3], b[3]) - max(a[2], b[2]))
        if area < (1e-4 if floor else 2e-4):
            return False
        za, zb = one["position"]["z"], other["position"]["z"]
        upper, lower = (a, b) if za > zb else (b, a)
        return not (floor and abs(za - zb) > 0.01 and _beyond(upper, lower) <= 0.05)

    def _misplaced(self, item: Data) -> bool:
        label = item["initial_location"]
        if self.on_floor(item) or label not in (*KINDS, "reagent_cabinet"):
            return False
        layers = (("acid", 0.8), ("base", 1.1), ("flammable", 1.3), ("oxidizer", 1.3), ("reactive_metal", 1.3))
        height = next((z for flag, z in layers if self.flag(item, flag)), 1.5)
        return abs(item["position"]["z"] - (height if SNAKE.get(label, label) == "ReagentCabinet" else 0.8)) > 0.01

    def chemistry(self) -> dict[str, float]:
        constraints = [*self._distances(), *self._single()]
        values: dict[str, float] = {}
        for category, kinds in CATEGORIES.items():
            scores = sorted(score for kind, _, score in constraints if kind in kinds)
            values[f"{category}_count"] = len(scores)
            scores = scores[:3] if category in ("flam", "incomp") else scores
            values[category] = sum(scores) / len(scores) if scores else 1.0
        weight = sum(each[1] for each in constraints)
        values["overall"] = sum(w * score for _, w, score in constraints) / weight if weight else 1.0
        return values

    def _judged(self, item: Data) -> Data:
        return next(each for each in self.objects if item["id"] in each["id"])

    def _distances(self) -> list[tuple[str, int, float]]:
        rows = []
        for kind, first, second, weight in DISTANCES:
            for one, other in itertools.product(self.objects, repeat=2):
                if one["id"] != other["id"] and self.flag(one, first) and self.flag(other, second):
                    ends = self._judged(one), self._judged(other)
                    (x, y, z), (u, v, w) = ([end["position"][axis] for axis in "xyz"] for end in ends)
                    shelved = all(_is_cabinet(end["initial_location"]) for end in ends)
                    layered = kind != "C1" and shelved and abs(z - w) > 0.1
                    rows.append((kind, weight, 1.0 if layered else curve(math.hypot(x - u, y - v) / 1.5)))
        return rows

    def _single(self) -> list[tuple[str, int, float]]:
        reagents = [each for each in self.objects if self.asset(each["id"]).get("type") == "reagent"]
        rows = [("C3", 5, self._stored(self._judged(each))) for each in reagents]
        floor = [each for each in self.objects if each["initial_location"] == "floor"]
        for each in self.objects:
            if self.flag(each, "glass_container"):
                judged = self._judged(each)
                surface = self._called(judged["initial_location"], floor)
                edge = math.inf if surface is None else max(0.0, -_beyond(self.box(judged), self.box(surface)))
                rows.append(("C4", 3, curve(edge / 0.3)))
        return rows

    def _stored(self, item: Data) -> float:
        cabinet = next((each for each in self.objects if _is_cabinet(each["id"])), None)
        if cabinet is None:
            return 0.0
        sides = self.asset("ReagentCabinet")["geometry"]["bbox"]
        width, depth = sides["long"], sides["short"]
        if abs(cabinet["rotation"]["z"]) in (90, 270):
            width, depth = depth, width
        (x, y, z), (u, v, w) = ([each["position"][axis] for axis in "xyz"] for each in (item, cabinet))
        return float(abs(x - u) <= width / 2 and abs(y - v) <= depth / 2 and w <= z <= w + sides["height"])


def _beyond(box: tuple[float, ...], bounds: tuple[float, ...]) -> float:
    return max(bounds[0] - box[0], box[1] - bounds[1], bounds[2] - box[2], box[3] - bounds[3])


def _is_cabinet(name: str) -> bool:
    return "ReagentCabinet" in name or "reagent_cabinet" in name.lower()
