"""Files of settings, packs of training floors and gold action lists."""

from __future__ import annotations

import gzip
import hashlib
import json
from collections.abc import Iterator
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from laboratories import hall_laboratory

from fuzz.mutation import mutated_bytes, mutated_data, mutated_file, mutated_json
from fuzz.target import Case, Target
from labgym.envs.labnav import pack
from labgym.envs.labnav.drawing import draw_floor
from labgym.envs.presets import configured
from labgym.protocols.reading.agreement import score
from labgym.protocols.reading.gold import read_gold
from labgym.protocols.reading.reader import read_procedure
from labgym.training.hyperparameters import FOLDER, Hyperparameters

ENVIRONMENT = """split: train
control_dt: 0.1
training: rooms
resident_mb: 200
sensors: [goal, velocity, {kind: lidar, rays: 90, reach: 8.0, noise: [{kind: gaussian, sigma: 0.03}]}]
weights: {progress: 1.0, collision: -2, time: -0.01}
measures: [success, path_length]
actions: velocity
loose: false
"""
GOLD: tuple[dict[str, Any], ...] = (
    {
        "id": "a",
        "text": "Water (5 mL) was added at 20 C. The mixture was stirred overnight.",
        "outcome": "complete",
        "tuples": [
            {
                "order": 1,
                "op": "Add",
                "substance": "Water",
                "substance_span": [0, 5],
                "amount": [{"value": 5, "unit": "mL"}],
                "conditions": [{"kind": "T", "value": 20}],
                "phase": None,
                "repeat": 1,
            },
            {
                "order": 2,
                "op": "Stir",
                "substance": None,
                "amount": [],
                "conditions": [{"kind": "t", "value": "overnight"}],
            },
        ],
    },
    {"id": "b", "text": "Stir.", "hash": hashlib.sha256(b"Stir.").hexdigest()[:16], "outcome": "partial", "tuples": []},
)
PPO = "LabPointNav-v0"


def targets() -> Iterator[Target]:
    """Yield the targets."""
    yield Target("environment file", lambda: partial(_text, "a.yaml", ENVIRONMENT), _configure, ("yaml",), share=0.5)
    yield Target("hyperparameters", _hyperparameters, _train, ("yaml",), share=0.5)
    yield Target("pack of floors", lambda: _pack, _draw)
    yield Target("gold action lists", lambda: _gold, _score, share=0.5)


def _text(name: str, text: str, rng: Random | None) -> Case:
    return {name: text.encode() if rng is None else mutated_file(rng, text)}


def _configure(folder: Path) -> None:
    configured(folder / "a.yaml", {})


def _hyperparameters() -> partial[Case]:
    return partial(_text, "ppo.yml", (FOLDER / "ppo.yml").read_text())


def _train(folder: Path) -> None:
    """Read hyperparameters as `labgym train ppo` does before it makes the environments."""
    read = Hyperparameters.load("ppo", PPO, folder / "ppo.yml")
    read.algorithm_arguments(), read.environment_options(), read.environment_options(True)
    assert read.steps >= read.leg > 0


@cache
def _floor() -> dict[str, Any]:
    layout = hall_laboratory()
    episodes, _ = draw_floor(layout, "glass", 1, 2, 0, 60)
    return {"layout": layout.to_json(), "episodes": {"glass-1": [one.model_dump(mode="json") for one in episodes]}}


def _pack(rng: Random | None) -> Case:
    floor = _floor()
    index = {
        "schema": pack.FloorPack.SCHEMA,
        "floors": ["floors/00000.json.gz"],
        "episodes": {"glass-1": [len(floor["episodes"]["glass-1"])]},
        "digest": "0" * 64,
    }
    files = {"pack.json": json.dumps(index).encode(), "floors/00000.json.gz": gzip.compress(json.dumps(floor).encode())}
    if rng is None:
        return files
    match rng.randrange(4):
        case 0:
            files["pack.json"] = mutated_json(rng, index)
        case 1:
            files["floors/00000.json.gz"] = mutated_bytes(rng, files["floors/00000.json.gz"])
        case 2:
            episodes = mutated_data(rng, floor["episodes"])
            files["floors/00000.json.gz"] = _packed({**floor, "episodes": episodes})
        case 3:
            files["floors/00000.json.gz"] = _packed(mutated_data(rng, floor))
    return files


def _packed(data: Any) -> bytes:
    return gzip.compress(json.dumps(data).encode("utf-8", "surrogatepass"), 1)


def _draw(folder: Path) -> None:
    """Draw each episode of a pack, as an environment does."""
    pack._floor.cache_clear()
    tasks = pack.PackTasks(folder, "glass-1", 64.0)
    for episode in range(2):
        task = tasks.draw(np.random.default_rng(0), {"episode": episode}, fresh=True)
        assert task.layout.placements


def _gold(rng: Random | None) -> Case:
    lines = [dict(line) for line in GOLD]
    if rng is not None:
        if rng.random() < 0.3:
            return {"gold.jsonl": mutated_file(rng, "\n".join(map(json.dumps, lines)))}
        at = rng.randrange(len(lines))
        lines[at] = mutated_data(rng, lines[at])
    return {"gold.jsonl": "\n".join(map(json.dumps, lines)).encode("utf-8", "surrogatepass")}


def _score(folder: Path) -> None:
    """Score as `labgym protocols score-reading` does."""
    score((item, read_procedure(item.text)) for item in read_gold(folder / "gold.jsonl"))
