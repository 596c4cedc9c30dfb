"""Protocol files that nobody should trust give one error that names the file and the field."""

from __future__ import annotations

import contextlib
import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from labgym.errors import DocumentError
from labgym.protocols import Protocol, get, validate

GOOD = get("con_03").to_json()


def changed(path: str, value: object) -> dict[str, object]:
    data = json.loads(json.dumps(GOOD))
    target = data
    *parents, last = [int(part) if part.isdigit() else part for part in path.split(".")]
    for part in parents:
        target = target[part]
    target[last] = value
    return data


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("id", "../../etc/passwd"),
        ("id", "A B"),
        ("id", 7),
        ("name", None),
        ("reaction_type", "alchemy"),
        ("reagents", []),
        ("reagents", {}),
        ("instruments", "Beaker"),
        ("instruments.0", "../Beaker"),
        ("steps", []),
        ("steps.0.index", 0),
        ("steps.0.index", 1.5),
        ("steps.0.location", ""),
        ("steps.0.temperature", "hot"),
        ("steps.0.temperature", -400),
        ("steps.0.duration", -1),
        ("steps.0.uses", [["Beaker"]]),
        ("steps.0.surprise", 1),
        ("chemical_constraints.0.kind", "explode"),
        ("spatial_constraints.0.object", 5),
    ],
)
def test_a_wrong_field_is_named(tmp_path, path, value):
    file = tmp_path / "protocol.json"
    file.write_text(json.dumps(changed(path, value)))
    with pytest.raises(DocumentError) as caught:
        Protocol.load(file)
    assert caught.value.field.startswith(path.removesuffix(".0"))
    assert "protocol.json" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        '"text"',
        "nul",
        json.dumps(GOOD)[:-40],
        json.dumps(changed("steps.0.temperature", float("nan"))),
        json.dumps(changed("steps.0.temperature", float("inf"))),
        json.dumps(changed("steps.0.temperature", 1e300)),
        json.dumps(changed("schema", "labgym.layout/1")),
        json.dumps(changed("description", "x" * 30_000)),
        json.dumps(changed("steps", GOOD["steps"] * 100)),
        "[" * 50_000 + "]" * 50_000,
        '{"schema": "labgym.protocol/1", "id": ' + "9" * 5000 + "}",
    ],
)
def test_a_broken_file_gives_one_line(tmp_path, text):
    file = tmp_path / "protocol.json"
    file.write_text(text)
    with pytest.raises(DocumentError) as caught:
        Protocol.load(file)
    assert "protocol.json" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_folder_a_missing_file_and_bytes_are_refused(tmp_path):
    (tmp_path / "bytes.json").write_bytes(b"\xff\xfe\x00")
    for path in (tmp_path, tmp_path / "missing.json", tmp_path / "bytes.json"):
        with pytest.raises(DocumentError):
            Protocol.load(path)


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=30),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=10), inner, max_size=4),
    max_leaves=10,
)


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(sorted(set(GOOD) - {"schema"})), JSON)
def test_any_value_is_validated_or_refused(field, value):
    with contextlib.suppress(DocumentError):
        assert isinstance(validate(Protocol.parse({**GOOD, field: value})), tuple)
