"""Autoprotocol: an experiment as instructions on one container.

Materials are provisioned under their names, and holding is an incubation. Autoprotocol has no instruction for most of
the other actions: they become instructions with the verb as their `op`, which a platform has to provide. The field
`x_remark` has what an instruction has no field for.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

from labgym.protocols.experiments import Action, Experiment, Portion
from labgym.protocols.experiments.model import HOLDING
from labgym.protocols.experiments.remarks import write_portion, write_remark
from labgym.quantities import amounts, plain_number
from labgym.units import BASE, SYMBOLS

BATCH, CONTAINER = "batch", "res-sw96-hp"
"""The container of the batch, and its type: the largest single one of Autoprotocol (170 mL)."""
_MODES = ("volume", "mass")
Instruction = dict[str, Any]


def written(experiment: Experiment) -> str:
    """Return the JSON of a protocol."""
    instructions = [item for action in experiment.actions for item in _instructions(action)]
    refs = {BATCH: {"new": CONTAINER, "discard": True}}
    return json.dumps({"refs": refs, "instructions": instructions}, ensure_ascii=False, indent=1)


def _instructions(action: Action) -> Iterator[Instruction]:
    yield from (_provision(portion) for portion in action.takes)
    stated = {
        "duration": _measure(action.duration, "minute"),
        "temperature": _measure(action.temperature, "celsius"),
        "pressure": _measure(action.pressure, "bar"),
    }
    expressed = [name for name, value in stated.items() if value is not None]
    if action.verb in HOLDING and action.duration is not None and action.pressure is None:
        heated = {"target_temperature": stated["temperature"]} if action.temperature is not None else {}
        incubation: Instruction = {
            "op": "incubate",
            "object": BATCH,
            "where": "ambient",
            "duration": stated["duration"],
        }
        incubation |= {"shaking": False, "co2_percent": 0, **heated}
        yield incubation | _remark(write_remark(action, expressed, None))
        return
    remark = write_remark(action, expressed, "Add" if action.takes and not expressed else None)
    if action.verb != "Add" or remark:
        op = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", action.verb).lower()
        yield {"op": op, "object": BATCH, **{name: stated[name] for name in expressed}} | _remark(remark)


def _provision(portion: Portion) -> Instruction:
    """Return the instruction that adds a material; without a volume or mass, it is none that Autoprotocol has."""
    found = (item for mode in _MODES for item in amounts(portion.amount) if item.dimension == mode)
    quantity = next(found, None)
    if quantity is None:
        instruction = {"op": "add", "object": BATCH, "resource_id": portion.name}
        return instruction | _remark(write_portion(portion, ""))
    value = float(f"{quantity.base * quantity.portions:.6g}")
    unit = BASE[quantity.dimension]
    return {
        "op": "provision",
        "resource_id": portion.name,
        "measurement_mode": quantity.dimension,
        "to": [{"well": f"{BATCH}/0", quantity.dimension: _measure(value, unit)}],
    } | _remark(write_portion(portion, f"{plain_number(value)} {SYMBOLS[unit]}"))


def _remark(text: str) -> Instruction:
    return {"x_remark": text} if text else {}


def _measure(value: float | None, unit: str) -> str | None:
    return None if value is None else f"{plain_number(value)}:{unit}"
