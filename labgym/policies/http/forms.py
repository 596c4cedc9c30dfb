"""Encoding and bounded decoding of multipart/form-data (RFC 7578), as far as the protocol uses it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from email.message import Message

from labgym.policies.http.wire import WireError

MAX_PARTS = 32
MAX_HEADER = 4096
"""Bytes of one part's header."""


def encode_form(fields: Mapping[str, str], files: Mapping[str, tuple[str, str, bytes]]) -> tuple[str, bytes]:
    """Return the content type and the body of a form.

    Args:
        fields: texts by name.
        files: (file name, content type, bytes) by name.
    """
    parts = [(f'name="{name}"', "", text.encode()) for name, text in fields.items()]
    parts += [
        (f'name="{name}"; filename="{file}"', f"Content-Type: {kind}\r\n", data)
        for name, (file, kind, data) in files.items()
    ]
    boundary = _boundary([data for _, _, data in parts])
    body = b"".join(
        f"--{boundary}\r\nContent-Disposition: form-data; {place}\r\n{kind}\r\n".encode() + data + b"\r\n"
        for place, kind, data in parts
    )
    return f"multipart/form-data; boundary={boundary}", body + f"--{boundary}--\r\n".encode()


def decode_form(content_type: str, body: bytes) -> dict[str, bytes]:
    """Return the content of each part by its name; the last of several parts with one name.

    Raises:
        WireError: the body is not a form, a part has no name, or there are too many parts.
    """
    header = Message()
    header["Content-Type"] = content_type
    boundary = header.get_boundary()
    if header.get_content_type() != "multipart/form-data" or not boundary or len(boundary) > 200:
        raise WireError(f"expected multipart/form-data with a boundary, got {content_type[:80]!r}")
    pieces = (b"\r\n" + body).split(b"\r\n--" + boundary.encode("latin-1", "replace"), MAX_PARTS + 1)
    if len(pieces) < 2 or not pieces[-1].startswith(b"--"):
        raise WireError(f"the form is incomplete or has more than {MAX_PARTS} parts")
    return dict(_part(piece) for piece in pieces[1:-1])


def _part(piece: bytes) -> tuple[str, bytes]:
    head, gap, data = piece.partition(b"\r\n\r\n")
    if not gap or len(head) > MAX_HEADER:
        raise WireError(f"a part of the form has no header or one of more than {MAX_HEADER} bytes")
    header = Message()
    for line in head.decode("latin-1").split("\r\n"):
        name, _, value = line.partition(":")
        if name.strip():
            header[name.strip()] = value.strip()
    part = header.get_param("name", header="content-disposition")
    if not isinstance(part, str) or not part:
        raise WireError("a part of the form has no name")
    return part, data


def _boundary(contents: list[bytes]) -> str:
    while True:
        boundary = f"labgym-{os.urandom(16).hex()}"
        if not any(boundary.encode() in data for data in contents):
            return boundary
