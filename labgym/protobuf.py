"""The wire format of protocol buffers: the fields of a message with a length, without its definition."""

from __future__ import annotations

from collections.abc import Iterator

_VARINT, _FIXED_64, _LENGTH, _FIXED_32 = 0, 1, 2, 5
"""Wire types."""


def sized_fields(content: bytes, start: int = 0, end: int | None = None) -> Iterator[tuple[int, int, int]]:
    """Yield number, start and end of each field with a length (text, bytes, message) of a message.

    A field of another type is yielded as one of no length.

    Args:
        content: bytes that contain the message. start, end: where it lies in them.

    Raises:
        ValueError: the bytes are no message, or are cut off.
    """
    at, end = start, len(content) if end is None else end
    while at < end:
        key, at = _varint(content, at, end)
        number, kind = key >> 3, key & 7
        size = 0
        if kind == _LENGTH:
            size, at = _varint(content, at, end)
        elif kind == _VARINT:
            _, at = _varint(content, at, end)
        else:
            at += {_FIXED_64: 8, _FIXED_32: 4}.get(kind, end + 1)
        if number == 0 or at + size > end:
            raise ValueError("not a protocol buffer, or cut off")
        yield number, at, at + size
        at += size


def _varint(content: bytes, at: int, end: int) -> tuple[int, int]:
    """Return the number at a position and the position after it, which is beyond the end if the number is broken."""
    value = shift = 0
    while at < end and shift < 64:
        byte = content[at]
        value |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if byte < 0x80:
            return value, at
    return 0, end + 1
