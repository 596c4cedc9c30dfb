"""Open Reaction Database files in every format, what becomes of each field, and what broken ones come to."""

from __future__ import annotations

import base64
import gzip
import json
import sys
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from labgym.errors import DocumentError, MissingDependencyError
from labgym.protocols.amounts import read_amount
from labgym.protocols.experiments import Experiment, Rejection
from labgym.protocols.importers import ord as reactions
from labgym.protocols.importers import ord_files, read
from labgym.protocols.importers.ord_messages import messages

pytest.importorskip("google.protobuf")

SERIALIZED = base64.b64decode(
    "CgF0EgFkGtMCCiIIBhocQ0NPLkNDKD1PKU8+PkNDT0MoQyk9TyB8ZjoxfCABEjcKBGFjaWQSLworCgsIAhoHQ0MoPU8pTwoPCAYa"
    "C2FjZXRpYyBhY2lkEgkKBw0AAMBAGAIYARgBEjIKA2FsYxIrChoKCwgGGgdldGhhbm9sEgkaBw0AAEhCGAIYAxgCKgIIBEoHDTOT"
    "iEMYAxoECgIIAiITCgkSBw0AAJxCGAESBBoCCAM4ASoKSghTdGlyIGl0LjonCAYiGgoYCgkIBhoFZXRoZXISCRoHDc3MzD0YARgF"
    "OgdvcmdhbmljOh0IARIZUmVjcnlzdGFsbGl6ZWQgZnJvbSB3YXRlckI6CgcNAAAAQBgBGi8KEQgGGg1ldGh5bCBhY2V0YXRlCg0I"
    "AhoJQ0NPQyhDKT1PEAEaCRADQgUNAACjQkoIIgYxMC4xL3hSC29yZC0wMTIzQUJDKg1vcmRfZGF0YXNldC0w"
)
"""A dataset of one reaction, serialized by ord-schema 0.9.6 with fields that an experiment has no use for."""
REACTION = """
  reaction_id: "ord-1"
  inputs { key: "b" value { addition_order: 2 components { reaction_role: REACTANT
    identifiers { type: SMILES value: "CCBr" } identifiers { type: NAME value: "ethyl bromide" }
    amount { moles { value: 0.05 units: MOLE } } } } }
  inputs { key: "a" value { addition_order: 1 components { reaction_role: CATALYST
    identifiers { type: SMILES value: "[Pd]" } amount { mass { value: 250 units: MILLIGRAM precision: 1 } } } } }
  outcomes { products { identifiers { type: SMILES value: "CC" } } }
"""


def dataset(text: str) -> Any:
    from google.protobuf import text_format

    return text_format.Parse(text, messages()[0](), allow_unknown_field=True)


def one(tmp_path: Path, reaction: str) -> Experiment | Rejection:
    file = tmp_path / "d.pbtxt"
    file.write_text(f"reactions {{ {reaction} }}", encoding="utf-8")
    (found,) = read(file, "ord")
    return found


def experiment(tmp_path: Path, reaction: str) -> Experiment:
    found = one(tmp_path, reaction)
    assert isinstance(found, Experiment), found
    return found


def test_what_ord_schema_wrote_is_read_in_full(tmp_path: Path) -> None:
    file = tmp_path / "d.pb"
    file.write_bytes(SERIALIZED)
    (found,) = read(file, "ord")
    assert isinstance(found, Experiment)
    assert (found.id, found.name, found.product) == ("ord_0123abc", "ethyl acetate", "ethyl acetate")
    assert found.reaction == "CCO.CC(=O)O>>CCOC(C)=O"
    assert (found.description, found.origin, found.license) == ("Stir it.", "ord", "CC-BY-SA-4.0")
    assert [(m.name, m.role, m.smiles) for m in found.materials] == [
        ("acetic acid", "reactant", "CC(=O)O"),
        ("ethanol", "solvent", ""),
        ("ether", "workup", ""),
    ]
    first, second, held, extracted, crystallised, yielded = found.actions
    assert first.takes[0].amount == "6 g"
    assert (second.takes[0].amount, second.temperature, second.manner) == ("50 mL", 0.0, "dropwise")
    assert (held.verb, held.temperature, held.duration, held.atmosphere) == ("Reflux", 78.0, 120.0, "nitrogen")
    assert (extracted.verb, extracted.takes[0].amount, extracted.keep) == ("Extract", "0.1 L", "organic")
    assert crystallised.verb == "Recrystallize"
    assert yielded.note == "yield 81.5 %"


def _json(data: Any) -> bytes:
    from google.protobuf import json_format

    plain = json_format.MessageToDict(data)
    for reaction in plain["reactions"]:
        reaction["inputs"] = {entry["key"]: entry["value"] for entry in reaction["inputs"]}
        reaction["setup"] = {"vessel": {"type": "VIAL"}}
    import json

    return json.dumps(plain).encode()


WRITERS: dict[str, Callable[[Any], bytes]] = {
    "d.pb": lambda data: data.SerializeToString(),
    "d.binpb": lambda data: data.SerializeToString(),
    "d.pb.gz": lambda data: gzip.compress(data.SerializeToString()),
    "d.pbtxt": lambda data: str(data).encode(),
    "d.txtpb.gz": lambda data: gzip.compress(str(data).encode()),
    "d.json": _json,
}


@pytest.mark.parametrize("name", [*WRITERS, "d.parquet"])
def test_every_format_of_a_dataset_says_the_same(tmp_path: Path, name: str) -> None:
    data = dataset(f"reactions {{ {REACTION} }} reactions {{ {REACTION.replace('ord-1', 'ord-2')} }}")
    file = tmp_path / name
    if name in WRITERS:
        file.write_bytes(WRITERS[name](data))
    else:
        parquet = pytest.importorskip("pyarrow.parquet")
        pyarrow = pytest.importorskip("pyarrow")
        rows = {
            "reaction_id": [reaction.reaction_id for reaction in data.reactions],
            "reaction": [reaction.SerializeToString() for reaction in data.reactions],
        }
        parquet.write_table(pyarrow.table(rows), file)
    found = list(read(file, "ord"))
    assert [item.id for item in found if isinstance(item, Experiment)] == ["ord_1", "ord_2"]
    first = found[0]
    assert isinstance(first, Experiment)
    assert [action.takes[0].name for action in first.actions[:2]] == ["[Pd]", "ethyl bromide"]
    assert [action.takes[0].amount for action in first.actions[:2]] == ["250 mg", "0.05 mol"]
    assert first.reaction == "CCBr>[Pd]>CC"


@pytest.mark.parametrize(
    "conditions, verb",
    [
        ("temperature { setpoint { value: 20 units: CELSIUS } }", "Stir"),
        ("temperature { setpoint { value: -78 units: CELSIUS } }", "Cool"),
        ("temperature { setpoint { value: 212 units: FAHRENHEIT } }", "Heat"),
        ("temperature { control { type: MICROWAVE } setpoint { value: 150 units: CELSIUS } }", "Microwave"),
        ("illumination { type: LED }", "Irradiate"),
        ("stirring { type: SONICATION }", "Sonicate"),
        ("stirring { type: STIR_BAR }", "Stir"),
        ("reflux: true", "Reflux"),
    ],
)
def test_conditions_say_how_the_mixture_is_held(tmp_path: Path, conditions: str, verb: str) -> None:
    found = experiment(tmp_path, f"{REACTION} conditions {{ {conditions} }}")
    assert found.actions[2].verb == verb
    if "FAHRENHEIT" in conditions:
        assert found.actions[2].temperature == 100.0


@pytest.mark.parametrize(
    "pressure, bar", [("BAR", 2.0), ("PSI", 0.1378952), ("TORR", 2.0 / 750.0617), ("ATMOSPHERE", 2.0265)]
)
def test_pressures_are_in_bar(tmp_path: Path, pressure: str, bar: float) -> None:
    found = experiment(
        tmp_path, f"{REACTION} conditions {{ pressure {{ setpoint {{ value: 2 units: {pressure} }} }} }}"
    )
    assert found.actions[2].pressure == pytest.approx(bar, rel=1e-3)


@pytest.mark.parametrize("kind", sorted(reactions._WORKUPS))
def test_every_kind_of_work_up_gives_an_action(tmp_path: Path, kind: str) -> None:
    found = experiment(
        tmp_path, f"{REACTION} workups {{ type: {kind} duration {{ value: 90 units: SECOND }} details: 'so' }}"
    )
    action = found.actions[-2]
    assert (action.verb, action.duration, action.note) == (reactions._WORKUPS[kind], 1.5, "so")


@pytest.mark.parametrize(
    ("extra", "note"),
    [
        ("conditions { flow { type: PLUG_FLOW_REACTOR } }", "the reaction is flow chemistry"),
        ("conditions { electrochemistry { type: CONSTANT_CURRENT } }", "the reaction is electrochemistry"),
        ("workups { type: CUSTOM details: 'sang to it' }", "sang to it"),
        ("workups { type: CUSTOM }", "a work-up of the kind CUSTOM"),
    ],
)
def test_a_step_that_no_verb_expresses_becomes_a_note(tmp_path: Path, extra: str, note: str) -> None:
    found = experiment(tmp_path, REACTION + extra)
    assert [action.note for action in found.actions if action.verb == "Note"] == [note]


@pytest.mark.parametrize(
    ("details", "verb"),
    [
        ("Evaporated, then recrystallized from ethanol", "Concentrate"),
        ("Recrystallized from ethanol, then dried", "Recrystallize"),
        ("dried over MgSO4", "DrySolution"),
        ("The solvents were removed in vacuo", "Concentrate"),
    ],
)
def test_the_first_word_of_a_description_gives_the_verb(tmp_path: Path, details: str, verb: str) -> None:
    found = experiment(tmp_path, f"{REACTION} workups {{ type: CUSTOM details: '{details}' }}")
    (action,) = [action for action in found.actions if action.note == details]
    assert action.verb == verb


def test_a_nameless_component_is_turned_down_with_the_reason(tmp_path: Path) -> None:
    nameless = "inputs { key: 'z' value { components { amount { mass { value: 1 units: GRAM } } } } }"
    found = one(tmp_path, REACTION + nameless)
    assert isinstance(found, Rejection)
    assert "neither name" in found.reason


def test_an_enumeration_inside_a_message_of_early_files_is_read(tmp_path: Path) -> None:
    wrapped = b"\x22\x04\x0a\x02\x08\x04"  # illumination { type { type: LED } }
    file = tmp_path / "d.pb"
    reaction = dataset(f"reactions {{ {REACTION} }}").reactions[0].SerializeToString() + b"\x22\x06" + wrapped
    number = messages()[0].DESCRIPTOR.fields_by_name["reactions"].number
    file.write_bytes(bytes([number << 3 | 2]) + _length(reaction) + reaction)
    (found,) = read(file, "ord")
    assert isinstance(found, Experiment)
    assert "Irradiate" in [action.verb for action in found.actions]


def test_a_reaction_without_inputs_is_turned_down(tmp_path: Path) -> None:
    found = one(tmp_path, 'reaction_id: "ord-9"')
    assert isinstance(found, Rejection)
    assert "materials" in found.reason


@pytest.mark.parametrize(
    "name, content, problem",
    [
        ("d.pb", b"\x1a\xff\xff\xff\xff\x0fxx", "not an ORD dataset"),
        ("d.pbtxt", b"reactions { inputs {", "not an ORD dataset"),
        ("d.pbtxt", b"\xff\xfe\x00", "not an ORD dataset"),
        ("d.pbtxt", b"a { " * 20_000, "not an ORD dataset"),
        ("d.json", b"[1, 2", "not an ORD dataset"),
        ("d.json", b"[" * 200_000, "not an ORD dataset"),
        ("d.pb.gz", b"plain", "not gzipped"),
        ("d.pb.gz", gzip.compress(b"x" * 1000, mtime=0)[:-12], "cut off"),
        ("d.parquet", b"PAR1 no", "in Parquet"),
    ],
)
def test_a_file_that_is_no_dataset_is_refused(tmp_path: Path, name: str, content: bytes, problem: str) -> None:
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(DocumentError, match=problem):
        list(read(file, "ord"))


def test_a_bomb_is_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ord_files, "MAX_UNPACKED", 1000)
    file = tmp_path / "d.pb.gz"
    file.write_bytes(gzip.compress(bytes(100_000)))
    with pytest.raises(DocumentError, match="unpacks to more than 1000 bytes"):
        list(read(file, "ord"))


def test_in_a_folder_a_broken_file_does_not_stop_the_others(tmp_path: Path) -> None:
    (tmp_path / "a.pb").write_bytes(b"\xff\xff")
    (tmp_path / "b.pb").write_bytes(SERIALIZED)
    assert [type(item) for item in read(tmp_path, "ord")] == [Rejection, Experiment]


def test_without_protobuf_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "d.pb"
    file.write_bytes(SERIALIZED)
    monkeypatch.setitem(sys.modules, "google.protobuf", None)
    messages.cache_clear()
    try:
        with pytest.raises(MissingDependencyError, match=r"labgym-nav\[ord\]"):
            list(read(file, "ord"))
    finally:
        messages.cache_clear()


@pytest.mark.parametrize("value", [1e-6, 1.234e-3, 0.01234, 0.5, 12.34, 999.9, 1.234e4, 9.9e5])
@pytest.mark.parametrize(
    "unit, of, factor",
    [
        ("GRAM", "mass", 1.0),
        ("MILLIGRAM", "mass", 1e-3),
        ("MICROGRAM", "mass", 1e-6),
        ("LITER", "volume", 1000.0),
        ("MICROLITER", "volume", 1e-3),
        ("MOLE", "moles", 1.0),
        ("MICROMOLE", "moles", 1e-6),
    ],
)
def test_an_amount_of_any_size_is_read_back_as_it_was(
    tmp_path: Path, value: float, unit: str, of: str, factor: float
) -> None:
    stated = f"inputs {{ key: 'z' value {{ components {{ identifiers {{ type: NAME value: 'x' }} amount {{ {of} {{ value: {value:.9f} units: {unit} }} }} }} }} }}"  # noqa: E501
    found = experiment(tmp_path, REACTION + stated)
    (text,) = [p.amount for action in found.actions for p in action.takes if p.name == "x"]
    amount = read_amount(text)
    read_back = {"mass": amount.mass, "volume": amount.volume, "moles": amount.moles}[of]
    assert read_back == pytest.approx(value * factor, rel=1e-3)


@pytest.mark.parametrize("value", ["nan", "inf", "-3", "0"])
def test_an_amount_that_is_none_is_left_out(tmp_path: Path, value: str) -> None:
    stated = f"inputs {{ key: 'z' value {{ components {{ identifiers {{ type: NAME value: 'x' }} amount {{ mass {{ value: {value} units: GRAM }} }} }} }} }}"  # noqa: E501
    found = experiment(tmp_path, REACTION + stated)
    assert [p.amount for action in found.actions for p in action.takes if p.name == "x"] == [""]


def test_text_that_is_not_utf8_is_turned_down(tmp_path: Path) -> None:
    file = tmp_path / "d.pb"
    file.write_bytes(SERIALIZED.replace(b"ethanol", b"eth\xff\xfeol"))
    (found,) = read(file, "ord")
    assert isinstance(found, Rejection)
    assert "UTF-8" in found.reason


def test_a_file_of_several_gzip_streams_is_not_read_in_part(tmp_path: Path) -> None:
    file = tmp_path / "d.pb.gz"
    file.write_bytes(gzip.compress(SERIALIZED) * 2)
    with pytest.raises(DocumentError, match="several gzip streams"):
        list(read(file, "ord"))


def test_text_unfolds_and_is_bounded_more_tightly(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ord_files, "MAX_TEXT", 100)
    file = tmp_path / "d.json.gz"
    file.write_bytes(gzip.compress(b"[" + b"{}," * 1000 + b"{}]"))
    with pytest.raises(DocumentError, match="more than 100 bytes"):
        list(read(file, "ord"))


UNKNOWN = "identifiers { type: HOLOGRAM value: 'x' }"


def test_one_unknown_value_rejects_its_reaction_in_text(tmp_path: Path) -> None:
    file = tmp_path / "d.pbtxt"
    second = REACTION.replace("ord-1", "ord-2")
    text = f"""name: "a {{ b" # not {{ a block
      reactions {{ {UNKNOWN} {REACTION} }}
      reactions {{ {second} notes {{ procedure_details: "a }} brace" }} }}"""
    file.write_text(text, encoding="utf-8")
    first, other = read(file, "ord")
    assert isinstance(first, Rejection)
    assert first.place == "d.pbtxt:0"
    assert "HOLOGRAM" in first.reason
    assert "\n" not in first.reason
    assert isinstance(other, Experiment)
    assert (other.id, other.description) == ("ord_2", "a } brace")


def test_one_unknown_value_rejects_its_reaction_in_json(tmp_path: Path) -> None:
    from google.protobuf import json_format

    good = json_format.MessageToDict(dataset(f"reactions {{ {REACTION} }}"))["reactions"][0]
    bad = json.loads(json.dumps(good).replace('"MOLE"', '"BUSHEL"'))
    file = tmp_path / "d.json"
    file.write_text(json.dumps({"reactions": [bad, good, 7]}))
    first, second, third = read(file, "ord")
    assert isinstance(first, Rejection)
    assert "units has the unknown value 'BUSHEL'" in first.reason
    assert isinstance(second, Experiment)
    assert isinstance(third, Rejection)


def test_one_unknown_value_rejects_its_reaction_in_binary(tmp_path: Path) -> None:
    text = f"reactions {{ {REACTION} }} reactions {{ {REACTION.replace('ord-1', 'ord-2')} }}"
    content = dataset(text).SerializeToString()
    milligram, unknown = b"\x18\x03", b"\x18\x63"  # field 3, value 3; and value 99, which the schema does not have
    assert content.count(milligram) >= 2
    file = tmp_path / "d.pb"
    file.write_bytes(content.replace(milligram, unknown, 1))
    first, second = read(file, "ord")
    assert isinstance(first, Rejection)
    assert "unknown value 99" in first.reason
    assert isinstance(second, Experiment)


def test_the_names_that_older_files_have_for_a_value_are_known(tmp_path: Path) -> None:
    found = experiment(tmp_path, f"identifiers {{ type: NAME value: 'Heck' }} {REACTION}")
    assert found.id == "ord_1"


def test_a_broken_parquet_file_is_one_line(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    from pyarrow import table

    file = tmp_path / "d.parquet"
    parquet.write_table(table({"other": [b"x"]}), file)
    content = file.read_bytes()
    for broken in (content[:40] + b"\xff" * 20 + content[60:], content[:-30], content[:8] + content[20:]):
        file.write_bytes(broken)
        with pytest.raises(DocumentError) as caught:
            list(read(file, "ord"))
        assert "\n" not in str(caught.value)


def test_a_mistake_in_the_importer_is_not_taken_for_bad_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise TypeError("a bug")

    monkeypatch.setattr(reactions, "_product", broken)
    with pytest.raises(TypeError, match="a bug"):
        experiment(tmp_path, REACTION)


def test_a_small_file_that_unpacks_to_millions_of_reactions_is_refused_without_making_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ord_files, "MAX_REACTIONS", 200_000)
    file = tmp_path / "d.pb.gz"
    number = messages()[0].DESCRIPTOR.fields_by_name["reactions"].number
    file.write_bytes(gzip.compress(bytes([number << 3 | 2, 0]) * (ord_files.MAX_REACTIONS + 1)))
    assert file.stat().st_size < 10_000
    tracemalloc.start()
    with pytest.raises(DocumentError, match=r"has 200001 reactions; at most 200000 are read"):
        list(read(file, "ord"))
    assert tracemalloc.get_traced_memory()[1] < 2**21
    tracemalloc.stop()


def test_one_damaged_reaction_of_a_binary_file_does_not_cost_the_others(tmp_path: Path) -> None:
    whole = dataset(f"reactions {{ {REACTION} }}").reactions[0].SerializeToString()
    broken = whole[:-3] + b"\xff\xff\xff"
    number = messages()[0].DESCRIPTOR.fields_by_name["reactions"].number
    fields = [bytes([number << 3 | 2]) + _length(each) + each for each in (whole, broken, whole)]
    file = tmp_path / "d.pb"
    file.write_bytes(b"".join(fields))
    assert [type(record) for record in read(file, "ord")] == [Experiment, Rejection, Experiment]


def _length(content: bytes) -> bytes:
    return bytes([len(content) & 0x7F | 0x80, len(content) >> 7])


def test_a_json_dataset_of_very_many_values_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "d.json"
    file.write_bytes(b'{"reactions":[' + b"[]," * ord_files.MAX_VALUES + b"[]]}")
    with pytest.raises(DocumentError, match=r"d\.json: not an ORD dataset .*more than 3000000 values"):
        list(read(file, "ord"))


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("empty.pb", b"", "holds no reactions"),
        ("empty.pbtxt", b"# nothing\n" * 10_000, "holds no reactions"),
        ("texts.pbtxt", b"'" * 3_000_001, "not in reactions"),
        ("lines.pbtxt", b"\n" * 3_000_000, "not in reactions"),
        ("brackets.pbtxt", b"<" * 1_000_000, "not closed"),
        ("number.json", b'{"reactions": [{"conditions": {"ph": ' + b"9" * 100_000 + b"}}]}", "not an ORD dataset"),
        ("keys.json", b'{"reactions": [{"inputs": {"a": {}}}], "reactions": []}', "holds no reactions"),
        ("twice.pb.gz", gzip.compress(gzip.compress(SERIALIZED)), "not an ORD dataset"),
        ("utf-16.json", '{"reactions": []}'.encode("utf-16"), "UTF-8"),
    ],
)
def test_a_hostile_dataset_is_one_line(tmp_path: Path, name: str, content: bytes, problem: str) -> None:
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(DocumentError, match=problem) as error:
        list(read(file, "ord"))
    assert str(error.value).isprintable()
    assert str(error.value).count(str(file)) == 1


@pytest.mark.parametrize(
    ("reaction", "reason"),
    [
        ("unknown { " * 20_000 + "}" * 20_000, "not an ORD reaction"),
        ("workups { type: WASH } " * 300, "more than 250"),
        ("workups { type: WASH } " * 30_000, "more than 10000 messages"),
        ("inputs { key: 'a' value { " + "components { } " * 5_000 + "} }", "more than 30 components"),
        (f"{REACTION} conditions {{ ph: {'9' * 400} }}", "finite"),
        (f"{REACTION} conditions {{ temperature {{ setpoint {{ value: nan units: CELSIUS }} }} }}", "finite"),
        ("[a.b]: 5", "not an ORD reaction"),
    ],
)
def test_a_hostile_reaction_is_one_rejection(tmp_path: Path, reaction: str, reason: str) -> None:
    found = one(tmp_path, reaction)
    assert isinstance(found, Rejection)
    assert reason in found.reason
    assert found.reason.isprintable()


def test_a_dataset_in_text_may_begin_with_a_byte_order_mark_and_stand_on_one_line(tmp_path: Path) -> None:
    file = tmp_path / "d.pbtxt"
    plain = " ".join(REACTION.split())
    file.write_text(f'name: "a }} b" reactions {{ {plain} }} dataset_id: "}}" reactions: < {plain} >', "utf-8-sig")
    assert [type(item) for item in read(file, "ord")] == [Experiment, Experiment]


def test_names_have_no_characters_that_control_a_terminal(tmp_path: Path) -> None:
    found = experiment(tmp_path, REACTION.replace("ethyl bromide", "\u202eethyl\\n\\033[31m bromide"))
    assert "ethyl [31m bromide" in [material.name for material in found.materials]
