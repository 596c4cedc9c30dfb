"""Files of reactions and procedures: XDL, the Open Reaction Database, OpenExp, ChemTrans; experiments and protocols."""

from __future__ import annotations

import copy
import gzip
import io
import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

from openexp_record import RECORD as OPENEXP_RECORD

from fuzz.mutation import FLOATS, mutated_bytes, mutated_data, mutated_file, mutated_json
from fuzz.target import Case, Target
from labgym.protocols.experiments import Rejection
from labgym.protocols.experiments.library import read_experiments
from labgym.protocols.importers import read
from labgym.protocols.importers.ord_messages import messages

ROOT = Path(__file__).resolve().parents[3]
XDL = """<?xml version="1.0" encoding="UTF-8"?>
<XDL><Synthesis>
 <Metadata product="methyl benzoate" description="An ester."/>
 <Hardware><Component id="reactor" type="reactor"/><Component id="separator" type="separator"/></Hardware>
 <Reagents><Reagent name="benzoic acid" role="substrate"/><Reagent name="methanol" role="solvent"/>
  <Reagent name="ether"/></Reagents>
 <Procedure>
  <Prep><Add vessel="reactor" reagent="benzoic acid" mass="12.2 g"/>
   <Add vessel="reactor" reagent="methanol" volume="40 mL" stir="True" time="10 mins" dropwise="True"/></Prep>
  <Reaction><HeatChill vessel="reactor" temp="65°C" time="2 hrs"/><StopHeatChill vessel="reactor"/></Reaction>
  <Workup><Separate purpose="extract" from_vessel="reactor" to_vessel="rotavap" solvent="ether"
   solvent_volume="30 mL" repeats="3" product_phase="top"/></Workup>
  <Purification><Evaporate vessel="rotavap" temp="40°C" pressure="300 mbar" time="30 mins"/></Purification>
 </Procedure></Synthesis></XDL>
"""
ORD = """
dataset_id: "ord_dataset-1"
reactions { reaction_id: "ord-1"
  identifiers { type: REACTION_SMILES value: "CCO.CC(=O)O>>CCOC(C)=O" }
  inputs { key: "a" value { addition_order: 1 addition_speed { type: DROPWISE } components { reaction_role: REACTANT
    identifiers { type: SMILES value: "CCBr" } identifiers { type: NAME value: "ethyl bromide" }
    amount { moles { value: 0.05 units: MOLE } } } } }
  inputs { key: "b" value { components { reaction_role: SOLVENT
    identifiers { type: NAME value: "ethanol" } amount { volume { value: 50 units: MILLILITER } } } } }
  conditions { temperature { setpoint { value: 78 units: CELSIUS } } reflux: true }
  workups { type: EXTRACTION input { components { identifiers { type: NAME value: "ether" } } } keep_phase: "organic" }
  outcomes { reaction_time { value: 2 units: HOUR } products { identifiers { type: SMILES value: "CC" } } }
}
reactions { reaction_id: "ord-2"
  inputs { key: "a" value { components { identifiers { type: NAME value: "water" } } } } }
"""
CHEMTRANS = (
    "[ add ] reagent:  ( name: indene & type: pure & mole: 0.25 mol & mass: 29.0 g &  ) & [ settemp ] temperature: "
    "−5°C & time: 1 hr & [ wash ] reagent:  ( name: brine & type: mixture & volume: 50 mL & batch:each: 2 &  )  & "
    "phase: organic layer & [ evaporate ] pressure: 300 mmHg & [ column ] reagent(adsorbent): silica & "
    "reagent(eluent): hexane & [ yield ] appearance: colorless & yield: 71% & mass(yield): 24.0 g & "
    "reagent:  ( name: the epoxide & type: pure &  )  &\n"
)
UNITS = ("pint",)
TABLES = ("pint", "pandas", "pyarrow.parquet")
"""Modules that take long to import, imported once before the forks."""


def targets() -> Iterator[Target]:
    """Yield a target for each format."""
    yield Target("import xdl", lambda: partial(_text, "a.xdl", XDL), partial(_import, "xdl"), UNITS)
    yield Target("import chemtrans", lambda: _chemtrans, partial(_import, "chemtrans"), UNITS)
    yield Target("import openexp", lambda: _openexp, partial(_import, "openexp"), UNITS)
    yield Target("import ord text", lambda: partial(_text, "a.pbtxt", ORD), partial(_import, "ord"), UNITS)
    yield Target("import ord json", _ord_json, partial(_import, "ord"), UNITS)
    yield Target("import ord binary container", partial(_ord_binary, False), partial(_import, "ord"), UNITS, share=0.5)
    yield Target("import ord binary fields", partial(_ord_binary, True), partial(_import, "ord"), UNITS, share=0.5)
    yield Target(
        "import ord parquet container", partial(_ord_parquet, False), partial(_import, "ord"), TABLES, share=0.5
    )
    yield Target("import ord parquet content", partial(_ord_parquet, True), partial(_import, "ord"), TABLES, share=0.5)
    yield Target("experiments", _experiments, lambda folder: read_experiments(folder))


def _import(kind: str, folder: Path) -> None:
    """Import the case's only file as `labgym protocols import` does; rejections have one line, like errors."""
    (path,) = folder.iterdir()
    for record in read(path, kind):
        if isinstance(record, Rejection):
            assert len(record.reason.splitlines()) <= 1, f"a rejection of several lines: {record.reason!r}"


def _text(name: str, text: str, rng: Random | None) -> Case:
    return {name: text.encode() if rng is None else mutated_file(rng, text)}


def _chemtrans(rng: Random | None) -> Case:
    return _text("dev_out.txt", CHEMTRANS * 2, rng)


def _openexp(rng: Random | None) -> Case:
    if rng is None:
        return {"train.json": json.dumps([OPENEXP_RECORD]).encode()}
    record = copy.deepcopy(OPENEXP_RECORD)
    if rng.random() < 0.5:
        record["actions"] = mutated_file(rng, str(record["actions"])).decode("utf-8", "replace")
        return {"train.json": json.dumps([record, OPENEXP_RECORD]).encode()}
    return {"train.json": mutated_json(rng, [record, OPENEXP_RECORD])}


def _dataset() -> Any:
    from google.protobuf import text_format

    return text_format.Parse(ORD, messages()[0](), allow_unknown_field=True)


def _ord_json() -> Callable[[Random | None], Case]:
    from google.protobuf import json_format

    plain = json_format.MessageToDict(_dataset())
    for reaction in plain["reactions"]:
        reaction["inputs"] = {entry["key"]: entry["value"] for entry in reaction["inputs"]}
    return lambda rng: {"a.json": json.dumps(plain).encode() if rng is None else mutated_json(rng, plain)}


def _ord_binary(inside: bool) -> Callable[[Random | None], Case]:
    content = _dataset().SerializeToString()

    def make(rng: Random | None) -> Case:
        if rng is None:
            return {"a.pb": content}
        data = mutated_message(rng, content) if inside else mutated_bytes(rng, content)
        if rng.random() < 0.2:
            packed = gzip.compress(data)
            return {"a.pb.gz": mutated_bytes(rng, packed) if rng.random() < 0.5 else packed}
        return {"a.pb": data}

    return make


def mutated_message(rng: Random, content: bytes) -> bytes:
    """Return a protocol buffer with a field, at any depth, changed, repeated, removed or of another type."""
    fields = list(_fields(content))
    if not fields:
        return rng.randbytes(3)
    at = rng.randrange(len(fields))
    number, kind, value = fields[at]
    inner = kind == 2 and len(value) > 1 and next(_fields(value), None) is not None
    if inner and rng.random() < 0.8:
        fields[at] = (number, kind, mutated_message(rng, value))
    else:
        match rng.randrange(6):
            case 0:
                del fields[at]
            case 1:
                fields.insert(at, fields[at])
            case 2:
                fields[at] = (rng.choice((number, 1, 2, 3, 99, 2**28)), 0, rng.choice((0, 1, 2**31, 2**63, 2**64 - 1)))
            case 3:
                fields[at] = (number, 2, mutated_bytes(rng, value) if isinstance(value, bytes) else rng.randbytes(8))
            case 4:
                fields[at] = (number, 5, rng.choice(FLOATS))
            case 5:
                fields[at] = (number, 1, rng.choice((b"\0" * 6 + b"\xf8\x7f", b"\0" * 6 + b"\xf0\x7f")))
    return b"".join(map(_field, fields))


def _fields(content: bytes) -> Iterator[tuple[int, int, Any]]:
    """Yield number, wire type and value of each field; nothing if the bytes are no message."""
    found, at = [], 0
    while at < len(content):
        key, at = _varint(content, at)
        number, kind = key >> 3, key & 7
        if kind == 0:
            value, at = _varint(content, at)
        elif kind in (1, 5):
            size = 8 if kind == 1 else 4
            value, at = content[at : at + size], at + size
        elif kind == 2:
            size, at = _varint(content, at)
            value, at = content[at : at + size], at + size
        else:
            return
        if not number or at > len(content):
            return
        found.append((number, kind, value))
    yield from found


def _varint(content: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while at < len(content) and shift < 70:
        value |= (content[at] & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if content[at - 1] < 0x80:
            return value, at
    return 0, len(content) + 1


def _field(field: tuple[int, int, Any]) -> bytes:
    number, kind, value = field
    key = _packed(number << 3 | kind)
    if kind == 0:
        return key + _packed(value)
    return key + (_packed(len(value)) + value if kind == 2 else value)


def _packed(value: int) -> bytes:
    parts = []
    while value > 0x7F:
        parts.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*parts, value])


def _ord_parquet(inside: bool) -> Callable[[Random | None], Case]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    reactions = [reaction.SerializeToString() for reaction in _dataset().reactions] * 5

    def written(columns: dict[str, Any]) -> bytes:
        stream = io.BytesIO()
        pq.write_table(pa.table(columns), stream)
        return stream.getvalue()

    seed = written({"reaction_id": [str(k) for k in range(10)], "reaction": reactions})

    def make(rng: Random | None) -> Case:
        if rng is None:
            return {"a.parquet": seed}
        if not inside:
            return {"a.parquet": mutated_bytes(rng, seed)}
        column: Any = list(reactions)
        match rng.randrange(8):
            case 0:
                column = pa.array(["text"] * 10)
            case 1:
                column = pa.array([rng.choice((1, 2.5, True))] * 10)
            case 2:
                column = pa.array([[each] for each in reactions])
            case 3:
                column = pa.array([{"a": each} for each in reactions])
            case 4:
                column = pa.chunked_array([reactions[:3], reactions[3:]]).dictionary_encode()
            case _:
                column[rng.randrange(10)] = rng.choice(
                    (None, b"", mutated_message(rng, reactions[0]), rng.randbytes(40))
                )
        return {"a.parquet": written({rng.choice(("reaction", "reaction", "reaction", "Reaction")): column})}

    return make


def _experiments() -> Callable[[Random | None], Case]:
    path = min((ROOT / "assets/experiments").glob("*.json"), key=lambda path: path.stat().st_size)
    data = json.loads(path.read_bytes())
    data["experiments"] = data["experiments"][:3]

    def make(rng: Random | None) -> Case:
        if rng is None:
            return {"a.json": json.dumps(data).encode(), "b.json": json.dumps(data | {"experiments": []}).encode()}
        return {"a.json": mutated_json(rng, data), "b.json": json.dumps(mutated_data(rng, data)).encode()}

    return make
