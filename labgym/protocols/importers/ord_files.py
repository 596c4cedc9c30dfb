"""Files of the Open Reaction Database: protocol buffers (binary, text, JSON, gzipped or not) or Parquet."""

from __future__ import annotations

import re
import zlib
from codecs import BOM_UTF8
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from labgym.documents import load_json, read_bytes
from labgym.errors import DocumentError, optional_package
from labgym.protobuf import sized_fields
from labgym.protocols.importers.ord_messages import messages
from labgym.protocols.importers.records import UnreadableError, one_line

MAX_BYTES = 512 * 1024**2
MAX_UNPACKED = 512 * 1024**2
MAX_BATCH = 128 * 1024**2
MAX_REACTION = 4 * 1024**2
MAX_TEXT = 64 * 1024**2
MAX_HEADER = 256 * 1024
"""Largest sizes in bytes: of a file, of what a gzipped file or a row group of Parquet unpacks to,
of the rows that are read at one time, of one reaction in Parquet, and of JSON or
text, which need many times their size in memory, and of what stands outside the reactions in a text."""
MAX_REACTIONS = 1_000_000
"""Largest number of reactions of a binary file; the Open Reaction Database has 2 million in all its files."""
MAX_VALUES = 3_000_000
"""Largest number of values of a JSON dataset; they take up to 600 MB."""
MAX_MESSAGES = 10_000
"""Largest number of messages of a reaction in text; published ones have some hundred."""
MAX_DEPTH = 50
FIRST_FIELD = b"\x08"
"""Tag of a number in the first field of a protocol buffer."""
BINARY, TEXT, JSON, PARQUET = (".pb", ".binpb"), (".pbtxt", ".txtpb"), (".json",), (".parquet",)
_TOKEN = re.compile(
    rb"(?P<opening>(?P<field>\breactions(?:\s{0,99}:)?\s{0,99})?[{<])|(?P<closing>[}>])|#[^\n]*+"
    rb"|\"(?:[^\\\n\"]|\\.)*+\"?|'(?:[^\\\n']|\\.)*+'?",
    re.DOTALL,
)
"""An opening bracket, perhaps of a reaction, a closing bracket, a comment or a text of protobuf's text format."""

Parse = Callable[[], Any]
"""A function that returns a reaction's message, or raises UnreadableError."""


def reactions(path: Path) -> Iterator[Parse]:
    """Return one function per reaction of a dataset, which parses that reaction.

    Raises:
        DocumentError: the file is not a dataset.
        MissingDependencyError: protobuf, or pyarrow for Parquet, is not installed.
    """
    name = path.name.lower().removesuffix(".gz")
    messages()
    if name.endswith(PARQUET):
        yield from _parquet(path)
        return
    content = _content(path)
    if name.endswith((*TEXT, *JSON)) and len(content) > MAX_TEXT:
        raise DocumentError(path, "", f"text of more than {MAX_TEXT} bytes; save it as .pb, which is read faster")
    if name.endswith(JSON):
        yield from _json(path, content)
    elif name.endswith(TEXT):
        yield from _text(path, content)
    else:
        yield from _binary(path, content)


def _content(path: Path) -> bytes:
    content = read_bytes(path, MAX_BYTES)
    if not path.name.lower().endswith(".gz"):
        return content
    unpacker = zlib.decompressobj(zlib.MAX_WBITS | 16)
    try:
        unpacked = unpacker.decompress(content, MAX_UNPACKED)
    except zlib.error:
        raise DocumentError(path, "", "not gzipped, although its name says so") from None
    if unpacker.unconsumed_tail:
        raise DocumentError(path, "", f"unpacks to more than {MAX_UNPACKED} bytes")
    if unpacker.unused_data.strip(b"\0"):
        raise DocumentError(path, "", "several gzip streams in one file; unpack it first")
    if not unpacker.eof:
        raise DocumentError(path, "", "cut off: its gzip stream does not end")
    return unpacked


def _binary(path: Path, content: bytes) -> Iterator[Parse]:
    """Yield the parsers of a serialized dataset, whose reactions are parsed one at a time.

    An empty reaction takes two bytes in the file and hundreds in memory: as a whole, a small file could fill it.
    """
    dataset, _ = messages()
    field = dataset.DESCRIPTOR.fields_by_name["reactions"].number
    count = sum(number == field for number, _, _ in _top_fields(path, content))
    if count > MAX_REACTIONS:
        raise DocumentError(path, "", f"has {count} reactions; at most {MAX_REACTIONS} are read from a file")
    for number, start, end in _top_fields(path, content):
        if number == field:
            yield partial(_serialized, content[start:end] if end - start <= MAX_REACTION else None)


def _top_fields(path: Path, content: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield number, start and end of each field with a length at the top level of a protocol buffer.

    Raises:
        DocumentError: the bytes are not a protocol buffer.
    """
    try:
        yield from sized_fields(content)
    except ValueError:
        raise DocumentError(path, "", "not an ORD dataset (its bytes are no protocol buffer, or are cut off)") from None


def _json(path: Path, content: bytes) -> Iterator[Parse]:
    try:
        data = load_json(content, path, MAX_VALUES)
    except DocumentError as error:
        raise DocumentError(path, "", f"not an ORD dataset ({one_line(error).removeprefix(f'{path}: ')})") from None
    entries = data.get("reactions") if isinstance(data, dict) else None
    if not isinstance(data, dict) or not isinstance(entries or [], list):
        raise DocumentError(path, "", "not an ORD dataset (expected a JSON object with a list of reactions)")
    for entry in entries or []:
        yield partial(_from_json, entry)


def _from_json(entry: Any) -> Any:
    from google.protobuf import json_format

    reaction = messages()[1]()
    if not isinstance(entry, dict):
        raise UnreadableError(f"expected a JSON object, got {type(entry).__name__}")
    if isinstance(entry.get("inputs"), dict):
        # On the wire a map is a list of entries, which is how the message is defined here.
        entry = {**entry, "inputs": [{"key": key, "value": value} for key, value in entry["inputs"].items()]}
    value = _unknown_value(entry, reaction.DESCRIPTOR)
    if value:
        raise UnreadableError(value)
    try:
        json_format.ParseDict(entry, reaction, ignore_unknown_fields=True, max_recursion_depth=MAX_DEPTH)
    except Exception as error:  # noqa: BLE001 - protobuf also raises SystemError, for half a surrogate pair
        raise UnreadableError(f"not an ORD reaction ({one_line(error)})") from None
    return reaction


def _unknown_value(data: Any, descriptor: Any) -> str:
    """Return a description of the first enumeration in JSON data that has an unknown value, or ""."""
    if not isinstance(data, dict):
        return ""
    fields = {**descriptor.fields_by_name, **descriptor.fields_by_camelcase_name}
    for key, value in data.items():
        field = fields.get(key)
        for item in value if isinstance(value, list) else [value]:
            if field is None:
                continue
            if field.enum_type is not None and isinstance(item, str) and not _is_value(item, field.enum_type):
                return f"{field.name} has the unknown value {item[:40]!r}"
            if field.message_type is not None:
                problem = _unknown_value(item, field.message_type)
                if problem:
                    return problem
    return ""


def _is_value(name: str, enumeration: Any) -> bool:
    """Return whether an enumeration has a value; protobuf's own search fails for half a surrogate pair."""
    return any(value.name == name for value in enumeration.values)


def _text(path: Path, content: bytes) -> Iterator[Parse]:
    from google.protobuf import text_format

    blocks, header = _blocks(path, content.removeprefix(BOM_UTF8))
    if len(header) > MAX_HEADER:
        raise DocumentError(path, "", f"not an ORD dataset (more than {MAX_HEADER} bytes are not in reactions)")
    try:
        text_format.Parse(header.decode("utf-8"), messages()[0](), allow_unknown_field=True)
    except (text_format.ParseError, ValueError, RecursionError) as error:
        raise DocumentError(path, "", f"not an ORD dataset ({one_line(error)})") from None
    for block in blocks:
        yield partial(_from_text, block)


def _from_text(block: bytes) -> Any:
    from google.protobuf import text_format

    if block.count(b"{") + block.count(b"<") > MAX_MESSAGES:
        raise UnreadableError(f"not an ORD reaction (it has more than {MAX_MESSAGES} messages)")
    try:
        return text_format.Parse(block.decode("utf-8"), messages()[1](), allow_unknown_field=True)
    except UnicodeDecodeError:
        raise UnreadableError("it has text that is not UTF-8") from None
    except (text_format.ParseError, ValueError, RecursionError) as error:
        raise UnreadableError(f"not an ORD reaction ({one_line(error)})") from None


def _blocks(path: Path, content: bytes) -> tuple[list[bytes], bytes]:
    """Return the text of each reaction of a dataset in text format, and the text around them."""
    blocks, header = list[bytes](), list[bytes]()
    depth, start, end = 0, -1, 0
    for token in _TOKEN.finditer(content):
        if token["opening"] is not None:
            if depth == 0 and token["field"] is not None:
                header.append(content[end : token.start()])
                start = token.end()
            depth += 1
        elif token["closing"] is not None:
            depth -= 1
            if depth == 0 and start >= 0:
                blocks.append(content[start : token.start()])
                start, end = -1, token.end()
        if len(blocks) > MAX_REACTIONS:
            raise DocumentError(path, "", f"has more than {MAX_REACTIONS} reactions")
    if depth > 0:
        raise DocumentError(path, "", "not an ORD dataset (a bracket is not closed)")
    return blocks, b"".join((*header, content[end:]))


def _parquet(path: Path) -> Iterator[Parse]:
    with optional_package("pyarrow", "reading Parquet datasets", "ord"):
        import pyarrow
        import pyarrow.parquet
    try:
        table = pyarrow.parquet.ParquetFile(path)
        groups = [table.metadata.row_group(index) for index in range(table.metadata.num_row_groups)]
        size = max((group.total_byte_size for group in groups), default=0)
        if size > MAX_UNPACKED:
            raise DocumentError(
                path, "", f"has a row group that unpacks to {size} bytes; at most {MAX_UNPACKED} are read"
            )
        # A value that is stored once may stand in every row of a batch.
        rows = min(max(MAX_BATCH // max(size, 1), 1), 100)
        for batch in table.iter_batches(batch_size=rows, columns=["reaction"]):
            for value in batch.column(0):
                yield partial(_serialized, value.as_py())
    except (pyarrow.ArrowException, OSError, KeyError, IndexError) as error:
        raise DocumentError(path, "", f"not an ORD dataset in Parquet ({one_line(error)})") from None


def _serialized(content: Any) -> Any:
    from google.protobuf.message import DecodeError

    if not isinstance(content, bytes) or len(content) > MAX_REACTION:
        raise UnreadableError(f"not a serialized reaction of at most {MAX_REACTION} bytes")
    try:
        return _known(messages()[1].FromString(content))
    except DecodeError:
        raise UnreadableError("not a serialized reaction") from None


def _known(message: Any) -> Any:
    """Return a message if all its enumerations have known values; others are among its unknown fields.

    Before ord-schema 0.3 some enumerations were the first field of a message, which is read, too.

    Raises:
        UnreadableError: a value is not known.
    """
    from google.protobuf.unknown_fields import UnknownFieldSet

    for unknown in UnknownFieldSet(message):
        field = message.DESCRIPTOR.fields_by_number.get(unknown.field_number)
        if field is not None and field.enum_type is not None:
            wrapped = unknown.data if isinstance(unknown.data, bytes) else b""
            if wrapped[:1] != FIRST_FIELD or len(wrapped) < 2 or wrapped[1] not in field.enum_type.values_by_number:
                raise UnreadableError(f"{field.name} has the unknown value {str(unknown.data)[:40]}")
            setattr(message, field.name, wrapped[1])
    for field, value in message.ListFields():
        if field.message_type is not None:
            for item in value if isinstance(value, Sequence) else [value]:
                _known(item)
    return message
