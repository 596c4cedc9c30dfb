from __future__ import annotations

import errno
import json
import random
import re
import tracemalloc
from typing import Annotated

import pytest
from pydantic import Field

from labgym import json_stream
from labgym.documents import (
    MAX_ELEMENTS,
    Document,
    append_text,
    parse_json,
    read_json,
    read_yaml,
    write_bytes,
)
from labgym.errors import DocumentError
from labgym.json_stream import stream_json


@pytest.mark.parametrize(
    ("data", "field"),
    [
        ({"a": [0, {"b": 1e300}]}, "a.1.b"),
        ([0, [2**60]], "1.0"),
        ({"x": float("inf")}, "x"),
        ({"deep": json.loads("[" * 40 + "]" * 40)}, "deep.0.0"),
    ],
)
def test_a_value_out_of_bounds_is_named_by_its_path(data, field):
    with pytest.raises(DocumentError) as error:
        parse_json(json.dumps(data).encode(), "a.json")
    assert error.value.field.startswith(field)


class Box(Document):
    SCHEMA = "labgym.box/1"

    width: float


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        ({"width": 1.0}, "box.json: field schema: missing; this kind of file has 'labgym.box/1' there"),
        ({"schema": None, "width": 1.0}, "expected 'labgym.box/1', got 'None'"),
        ({"schema": "labgym.box/2", "width": 1.0}, "expected 'labgym.box/1', got 'labgym.box/2'"),
    ],
)
def test_a_missing_or_other_schema_is_named_with_the_expected_one(data, problem):
    with pytest.raises(DocumentError, match=re.escape(problem)):
        Box.parse(data, "box.json")


@pytest.mark.parametrize(
    "value",
    [b"[]", b"1", b'"a"', b'"\\\\"', b'{"a":1}', b"[[1]]"],
    ids=["list", "number", "text", "escape", "object", "nested"],
)
def test_a_file_of_many_values_takes_little_memory(value):
    count = 40_000
    raw = b"[" + (value + b",") * count + value + b"]"
    tracemalloc.start()
    with pytest.raises(DocumentError, match=rf"a.json: more than {count} values"):
        parse_json(raw, "a.json", count)
    assert tracemalloc.get_traced_memory()[1] < 2**18
    tracemalloc.stop()


def test_a_text_that_never_closes_is_refused_in_linear_time():
    with pytest.raises(DocumentError, match=r"a.json: not valid JSON"):
        parse_json(b"[" + b'"' + b',\\"' * (2 * MAX_ELEMENTS), "a.json")


def test_commas_and_brackets_within_texts_are_no_values():
    text = "[{,]}" * MAX_ELEMENTS
    assert parse_json(json.dumps({"notes": [text, '\\"[[']}).encode(), "a.json") == {"notes": [text, '\\"[[']}


def test_an_object_of_very_many_unknown_fields_is_refused_without_a_list_of_them():
    data = {"schema": Box.SCHEMA, "width": 1.0} | {f"field {k}": 1 for k in range(100_000)}
    tracemalloc.start()
    with pytest.raises(DocumentError, match=r"document: not a Box: 100000 fields are unknown or invalid"):
        Box.parse(data)
    assert tracemalloc.get_traced_memory()[1] < 2**24
    tracemalloc.stop()


def test_the_report_on_a_list_of_invalid_items_takes_little_memory():
    class Boxes(Document):
        SCHEMA = "labgym.boxes/1"

        boxes: tuple[Box, ...] = ()
        sizes: dict[str, list[float]] = Field(default_factory=dict)

    wrong = {"schema": Boxes.SCHEMA, "boxes": [{}] * 100_000, "sizes": {"a": ["x"] * 100_000}}
    tracemalloc.start()
    with pytest.raises(DocumentError, match=r"field boxes.0"):
        Boxes.parse(wrong)
    assert tracemalloc.get_traced_memory()[1] < 2**20
    tracemalloc.stop()


def test_a_large_document_is_read(tmp_path):
    data = {"rows": [[index, 0.5] for index in range(200_000)]}
    path = tmp_path / "a.json"
    path.write_text(json.dumps(data))
    assert read_json(path) == data


class Shelf(Document):
    SCHEMA = "labgym.shelf/1"

    name: str = ""
    boxes: Annotated[tuple[Box, ...], Field(max_length=50)] = ()

    @classmethod
    def _read(cls, path):
        return stream_json(path, cls.SCHEMA, "boxes", Box, 50)


@pytest.mark.parametrize("seed", range(20))
def test_a_streamed_document_equals_one_that_is_read_whole(seed, tmp_path):
    rng = random.Random(seed)
    fields = [
        ("schema", Shelf.SCHEMA),
        ("name", rng.choice(["", "a", '"boxes": [', "é\u2028\\"])),
        ("boxes", [{"width": rng.uniform(0.1, 9.0)} for _ in range(rng.randrange(51))]),
    ]
    rng.shuffle(fields)
    text = json.dumps(dict(fields), indent=rng.choice([None, 0, 3]), ensure_ascii=rng.random() < 0.5)
    path = tmp_path / "shelf.json"
    path.write_bytes(rng.choice([b"", b"\xef\xbb\xbf"]) + text.encode() + rng.choice([b"", b" \n"]))
    assert Shelf.load(path) == Shelf.parse(read_json(path))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ('{"schema": "labgym.shelf/1", "boxes": [{"width": 1}, {"width": "x"}]}', "field boxes.1.width"),
        ('{"schema": "labgym.shelf/1", "boxes": [{"width": 1e300}]}', "boxes.0.width: number 1e[+]300"),
        ('{"schema": "labgym.shelf/2", "boxes": [7]}', "expected 'labgym.shelf/1', got 'labgym.shelf/2'"),
        ('{"schema": "labgym.shelf/1", "boxes": 7}', "boxes"),
        ('{"schema": "labgym.shelf/1", "boxes": [' + '{"width": 1},' * 50 + '{"width": 1}]}', "more than 50 entries"),
        ('{"schema": "labgym.shelf/1", "boxes": [' + "[" * 100_000, "nested deeper than 32 levels"),
        ('{"schema": "labgym.shelf/1", "boxes": [' + "[" * 40 + "]" * 40 + "]}", "nested deeper than 32 levels"),
        ('{"schema": "labgym.shelf/1", "boxes": [{"width": 1},]}', "not valid JSON"),
        ('{"schema": "labgym.shelf/1", "boxes": [{"width": 1}}', "not valid JSON"),
        ('{"schema": "labgym.shelf/1",}', "not valid JSON"),
        ('{"schema": "labgym.shelf/1"} {', "not valid JSON"),
        ('{1: 2}', "not valid JSON"),
        ("[1]", "expected a JSON object, got list"),
        ("", "not valid JSON"),
    ],
)  # fmt: skip
def test_a_broken_streamed_document_is_refused_in_one_line(text, problem, tmp_path):
    path = tmp_path / "shelf.json"
    path.write_text(text)
    with pytest.raises(DocumentError, match=problem) as error:
        Shelf.load(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("item", [b"[]", b'{"":1}', b"[[1]]"], ids=["list", "object", "nested"])
def test_a_streamed_document_of_very_many_values_takes_no_memory_for_them(item, tmp_path, monkeypatch):
    assert (json_stream.MAX_STREAM_ELEMENTS, json_stream.MAX_STREAM_FIELDS) == (6_000_000, 2_000_000)
    monkeypatch.setattr(json_stream, "MAX_STREAM_ELEMENTS", 600_000)
    monkeypatch.setattr(json_stream, "MAX_STREAM_FIELDS", 200_000)
    path = tmp_path / "shelf.json"
    path.write_bytes(b'{"boxes": [' + (item + b",") * 400_000 + item + b"]}")
    size = path.stat().st_size
    tracemalloc.start()
    with pytest.raises(DocumentError, match=r"more than 600000 values or 200000 fields"):
        Shelf.load(path)
    assert tracemalloc.get_traced_memory()[1] < size + 2**20
    tracemalloc.stop()


def test_a_full_disk_names_the_file(tmp_path, monkeypatch):
    def full(descriptor):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space left") as error:
        append_text(tmp_path / "rows.jsonl", "x")
    assert error.value.filename == str(tmp_path / "rows.jsonl")

    monkeypatch.setattr("os.write", lambda handle, data: full(handle))
    with pytest.raises(OSError, match="No space left") as error:
        write_bytes(tmp_path / "a.json", b"x")
    assert error.value.filename == str(tmp_path / "a.json")
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".a.json")]


def test_a_byte_order_mark_is_not_part_of_the_document(tmp_path):
    (tmp_path / "windows.json").write_bytes(b'\xef\xbb\xbf{"a": 1}')
    assert read_json(tmp_path / "windows.json") == {"a": 1}
    (tmp_path / "windows.json").write_bytes('{"a": 1}'.encode("utf-16"))
    with pytest.raises(DocumentError, match="save it as JSON in UTF-8"):
        read_json(tmp_path / "windows.json")


def laughs(depth: int) -> str:
    """A billion laughs: 10 ** depth values by aliases, or by none of them if they are refused."""
    lines = ["a0: &a0 [x]"] + [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, depth)]
    return "\n".join(lines)


BAD_YAML = {
    "billion laughs": laughs(30),
    "a merge": "a: &a {x: 1}\nb: {<<: *a}",
    "a Python object": "a: !!python/object/apply:os.system [id]",
    "deep": "[" * 5000 + "]" * 5000,
    "deeper than documents": "[" * 40 + "]" * 40,
    "infinite": "a: .inf",
    "a huge integer": "a: " + "9" * 10_000,
    "a tab": "a:\n\t- b",
    "a date that is none": "a: 2026-99-99",
}


@pytest.mark.parametrize("name", BAD_YAML)
def test_yaml_that_is_no_plain_data_is_refused_in_one_line(tmp_path, name):
    pytest.importorskip("yaml")
    path = tmp_path / "a.yaml"
    path.write_text(BAD_YAML[name])
    with pytest.raises(DocumentError, match=r"a\.yaml") as caught:
        read_yaml(path, 2**20, "a test")
    assert len(str(caught.value).splitlines()) == 1
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize("text", ["x: " + "[" * 50_000, "{a: " * 50_000, "- " * 50_000])
def test_deep_yaml_is_refused_by_its_depth(tmp_path, text):
    pytest.importorskip("yaml")
    (tmp_path / "a.yaml").write_text(text)
    with pytest.raises(DocumentError, match="nested deeper than") as caught:
        read_yaml(tmp_path / "a.yaml", 2**20, "a test")
    assert len(str(caught.value).splitlines()) == 1


def test_yaml_is_read_as_pyyaml_reads_it(tmp_path):
    yaml = pytest.importorskip("yaml")
    text = "image: map.png\nresolution: 0.05\norigin: [-1.0, 2, 0.0]\nnegate: 0 # no\nmode: trinary\n"
    (tmp_path / "a.yaml").write_text(text)
    assert read_yaml(tmp_path / "a.yaml", 2**20, "a test") == yaml.safe_load(text)
