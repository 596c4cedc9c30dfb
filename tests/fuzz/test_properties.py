"""Properties of the innermost parsers, on inputs that hypothesis makes and shrinks; `--fuzz-cases` many of each."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st

from labgym.cli.arguments import parse_options
from labgym.documents import MAX_DEPTH, parse_json
from labgym.errors import LabgymError
from labgym.layouts import Layout
from labgym.policies.http.forms import decode_form, encode_form
from labgym.protocols import Protocol

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=10),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=10), inner, max_size=4),
    max_leaves=10,
)


@pytest.fixture
def check(request: pytest.FixtureRequest) -> Callable[..., None]:
    """Return a function that runs a property on examples of strategies."""
    cases, start = request.config.getoption("--fuzz-cases"), request.config.getoption("--fuzz-seed")
    options = settings(max_examples=cases, deadline=None, database=None, suppress_health_check=list(HealthCheck))

    def run(prove: Callable[..., None], *strategies: Any) -> None:
        options(seed(start)(given(*strategies)(prove)))()

    return run


def refused_in_one_line(call: Callable[[], Any]) -> Any:
    """Return what a call returns, or None if it raises a LabgymError of one line."""
    try:
        return call()
    except LabgymError as error:
        message = str(error)
    assert len(message.splitlines()) == 1
    return None


def depth(data: Any) -> int:
    parts = data.values() if isinstance(data, dict) else data if isinstance(data, list) else ()
    return 1 + max(map(depth, parts), default=0)


def numbers(data: Any) -> list[float]:
    if isinstance(data, dict | list):
        return [each for part in (data.values() if isinstance(data, dict) else data) for each in numbers(part)]
    return [data] if isinstance(data, int | float) else []


def test_json_is_read_as_the_standard_library_reads_it_or_refused(check: Callable[..., None]) -> None:
    def prove(data: Any) -> None:
        result = refused_in_one_line(lambda: parse_json(json.dumps(data).encode(), "a.json"))
        within = all(math.isfinite(n) and abs(n) <= 2**53 for n in numbers(data))
        if result is not None:
            assert result == data
            assert depth(data) <= MAX_DEPTH
            assert within
        elif data is not None:
            assert not within or depth(data) > MAX_DEPTH or any(abs(n) > 1e9 for n in numbers(data))

    check(prove, JSON)


def test_bytes_are_json_or_refused(check: Callable[..., None]) -> None:
    def prove(raw: bytes) -> None:
        refused_in_one_line(lambda: parse_json(raw, "a.json"))

    check(prove, st.binary(max_size=60))


@pytest.mark.parametrize("kind", [Layout, Protocol])
def test_any_data_are_a_document_or_refused(check: Callable[..., None], kind: Any) -> None:
    def prove(data: Any, more: Any) -> None:
        fields = dict.fromkeys(kind.model_fields, more)
        refused_in_one_line(lambda: kind.parse(data))
        refused_in_one_line(lambda: kind.parse({"schema": kind.SCHEMA, **fields}))
        refused_in_one_line(lambda: kind.parse({"schema": kind.SCHEMA, "floor": data, "placements": more, "id": "a"}))

    check(prove, JSON, JSON)


def test_a_form_comes_back_and_any_bytes_are_a_form_or_refused(check: Callable[..., None]) -> None:
    def prove(fields: dict[str, bytes], kind: str, body: bytes) -> None:
        files = {name: ("f", "image/png", data) for name, data in fields.items()}
        assert decode_form(*encode_form({}, files)) == fields
        refused_in_one_line(lambda: decode_form(kind, body))
        refused_in_one_line(lambda: decode_form("multipart/form-data; boundary=x", b"--x\r\n" + body + b"\r\n--x--"))

    names = st.text(st.characters(codec="ascii", categories=["L", "N"]), min_size=1, max_size=8)
    check(prove, st.dictionaries(names, st.binary(max_size=40)), st.text(max_size=60), st.binary(max_size=80))


def test_any_texts_are_options_or_refused(check: Callable[..., None]) -> None:
    def prove(texts: list[str]) -> None:
        refused_in_one_line(lambda: parse_options(texts))

    check(prove, st.lists(st.text(max_size=40)))
