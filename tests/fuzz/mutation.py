"""Mutations of bytes, texts and JSON data; the same random generator gives the same mutation."""

from __future__ import annotations

import copy
import io
import json
import re
import zipfile
from collections.abc import Callable
from random import Random
from typing import Any

HOSTILE: tuple[Any, ...] = (
    *(None, True, False, 0, 1, -1, 2**31, -(2**63), 2**64, 10**30, 0.0, -0.0, 1e-320, 1e300, -1e9, 0.5, 7.25),
    *(
        float("nan"),
        float("inf"),
        float("-inf"),
        "",
        "a",
        "\n",
        "a\r\nb\u2028c",
        "\0",
        "\ud800",
        "é" * 50,
        "x" * 25_000,
    ),
    *("../../etc/passwd", "/dev/zero", "http://127.0.0.1:1/", "<script>", "${HOME}", "{0}", "%s%n", "nan", "1e999"),
    *([], {}, [[]], [{}], {"": None}, [0] * 3000, [[1.0, 2.0], [3.0]], {"schema": "labgym.layout/2"}),
)
"""Values that stand in for others: limits of types, line breaks, half a surrogate pair, paths, ragged lists."""

NUMBERS = (
    *(
        "0",
        "-0",
        "1e999",
        "-1e999",
        "nan",
        "inf",
        "-1",
        "4294967296",
        "18446744073709551616",
        "1e-400",
        "0x10",
        "1_000",
    ),
    *("9" * 40, "0." + "0" * 70 + "1", "1,5", "٣", ""),
)
TOKENS = (
    *("\n", "\r", "\0", "\t", "\\", '"', "'", "<", ">", "{", "}", "[", "]", "(", ")", ";", "&", "#", "%", "$1$", "@5@"),
    *("<!DOCTYPE x>", "<![CDATA[", "]]>", "&#0;", "\u2028", "\ufeff", "\U0001f9ea", "ſ", "İ", "x" * 5000, "((((" * 50),
)
FLOATS = (b"\0\0\xc0\x7f", b"\0\0\x80\x7f", b"\xff\xff\x7f\x7f")
"""NaN, infinity and the largest number, as float32 with the low byte first."""
INTEGERS = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


def mutated_bytes(rng: Random, content: bytes) -> bytes:
    """Return bytes with one to eight changes: bits, runs, numbers of machine size, pieces moved, or a cut."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 4, 8))):
        at, length = rng.randrange(len(data) + 1), rng.choice((1, 2, 4, 16, 256))
        match rng.randrange(8):
            case 0 if data:
                data[at % len(data)] ^= 1 << rng.randrange(8)
            case 1:
                data[at : at + length] = rng.randbytes(min(length, len(data) - at))
            case 2:
                data[at:at] = rng.randbytes(length)
            case 3:
                del data[at : at + length]
            case 4:
                data[at : at + 4] = rng.choice(INTEGERS).to_bytes(4, rng.choice(("little", "big")))
            case 5:
                other = rng.randrange(len(data) + 1)
                data[at:at] = data[other : other + length]
            case 6:
                data[at : at + length] = bytes(min(length, len(data) - at))
            case 7 if rng.random() < 0.3:
                del data[at:]
    return bytes(data)


def mutated_text(rng: Random, text: str) -> str:
    """Return a text with one to five changes of numbers, lines, words and characters."""
    for _ in range(rng.choice((1, 1, 2, 3, 5))):
        lines = text.split("\n")
        at = rng.randrange(len(lines))
        match rng.randrange(7):
            case 0 | 1:
                numbers = list(_NUMBER.finditer(text))
                if numbers:
                    number = rng.choice(numbers)
                    text = text[: number.start()] + rng.choice(NUMBERS) + text[number.end() :]
            case 2:
                place = rng.randrange(len(text) + 1)
                text = text[:place] + rng.choice(TOKENS) + text[place:]
            case 3:
                del lines[at]
                text = "\n".join(lines)
            case 4:
                lines.insert(at, rng.choice(lines))
                text = "\n".join(lines)
            case 5:
                words = re.findall(r"\w+", text) or [""]
                text = text.replace(rng.choice(words), rng.choice(words), 1)
            case 6:
                place = rng.randrange(len(text) + 1)
                text = text[:place] + text[place + rng.choice((1, 3, 40)) :]
    return text


def mutated_file(rng: Random, text: str) -> bytes:
    """Return a text file: its text changed, and now and then its bytes or its encoding."""
    content = mutated_text(rng, text).encode("utf-8", "surrogatepass")
    if rng.random() < 0.2:
        content = mutated_bytes(rng, content)
    if rng.random() < 0.02:
        content = content.decode("utf-8", "replace").encode(rng.choice(("utf-16", "utf-32", "utf-8-sig", "utf-7")))
    return content


def mutated_data(rng: Random, data: Any) -> Any:
    """Return JSON data with one to four changes: values replaced, removed, repeated, nested, moved; keys renamed."""
    data = copy.deepcopy(data)
    for _ in range(rng.choice((1, 1, 2, 4))):
        holders = list(_containers(data))
        if not holders:
            return rng.choice(HOSTILE)
        holder = rng.choice(holders)
        key = rng.choice(list(holder)) if isinstance(holder, dict) else rng.randrange(len(holder))
        match rng.randrange(8):
            case 0 | 1 | 2:
                holder[key] = copy.deepcopy(rng.choice(HOSTILE))
            case 3:
                del holder[key]
            case 4:
                other = rng.choice(holders)
                holder[key] = copy.deepcopy(rng.choice(list(other.values() if isinstance(other, dict) else other)))
            case 5:
                for _ in range(rng.choice((1, 5, 60))):
                    holder[key] = [holder[key]] if rng.random() < 0.5 else {"a": holder[key]}
            case 6 if isinstance(holder, list):
                holder += copy.deepcopy(holder[: rng.choice((1, 10, 2000))])
            case 6 | 7 if isinstance(holder, dict):
                holder[rng.choice((str(key) + "x", "", "schema", "cls", "__class__", "\n"))] = holder.pop(key)
            case 7 if isinstance(holder[key], int | float) and not isinstance(holder[key], bool):
                holder[key] = holder[key] * rng.choice((-1, 0, 2, 1e6, 1e-6, 1.5))
    return data


def mutated_json(rng: Random, data: Any) -> bytes:
    """Return a JSON file: mostly valid JSON of changed data, now and then changed as text."""
    if rng.random() < 0.15:
        return mutated_file(rng, json.dumps(data, ensure_ascii=False))
    return json.dumps(mutated_data(rng, data)).encode("utf-8", "surrogatepass")


def mutated_zip(rng: Random, content: bytes, change: Callable[[Random, str, bytes], bytes] | None = None) -> bytes:
    """Return a zip archive, valid as such, with a member changed, and now and then one renamed, missing or repeated.

    Args:
        change: changes a member, by its name and content.
    """
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = [(info.filename, archive.read(info)) for info in archive.infolist() if not info.is_dir()]
    for _ in range(rng.choice((1, 1, 2))):
        at = rng.randrange(len(members))
        name, data = members[at]
        if rng.random() < 0.85:
            members[at] = (name, (change or _changed_member)(rng, name, data))
        elif rng.random() < 0.5:
            members[at] = (rng.choice((name + "x", "../" + name, name.upper())), data)
        elif len(members) > 1:
            del members[at]
    stream = io.BytesIO()
    with zipfile.ZipFile(
        stream, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    ) as out:
        for name, data in dict(members).items():
            out.writestr(zipfile.ZipInfo(name), data)
    return stream.getvalue()


def _changed_member(rng: Random, name: str, data: bytes) -> bytes:
    return mutated_bytes(rng, data)


def _containers(data: Any) -> Any:
    """Yield every list and object of JSON data that is not empty."""
    if isinstance(data, dict | list) and data:
        yield data
        for part in data.values() if isinstance(data, dict) else data:
            yield from _containers(part)
