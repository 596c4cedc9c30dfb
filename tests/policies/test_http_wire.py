from __future__ import annotations

import email.parser
import email.policy
import io
import math
import struct
import zlib

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from labgym.policies.http.forms import MAX_PARTS, decode_form, encode_form
from labgym.policies.http.wire import (
    WireError,
    decode_color,
    decode_depth,
    encode_color,
    encode_depth,
    intrinsic_matrix,
)


def benchmark_picture(data: bytes, batch: int) -> np.ndarray:
    """Decode as that benchmark's servers do: Pillow to RGB, then the first and last channel swapped."""
    picture = np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))[..., ::-1]
    return picture.reshape(batch, -1, picture.shape[1], 3)


def benchmark_depth(data: bytes, batch: int) -> np.ndarray:
    depth = np.asarray(Image.open(io.BytesIO(data)).convert("I")).astype(np.float32) / 10000.0
    return depth.reshape(batch, -1, depth.shape[1])


def smooth(batch: int = 1, height: int = 90, width: int = 160) -> np.ndarray:
    x, y = np.meshgrid(np.linspace(0, 1, width), np.linspace(0, 1, height))
    one = np.stack([255 * x, 255 * y, 255 * (1 - x)], axis=-1)
    return np.stack([(one * (k + 1) / batch) for k in range(batch)]).astype(np.uint8)


def test_a_red_picture_reaches_the_benchmarks_servers_red_and_looks_blue_in_a_viewer():
    red = np.zeros((1, 48, 64, 3), np.uint8)
    red[..., 0] = 255
    data = encode_color(red)
    np.testing.assert_allclose(benchmark_picture(data, 1).mean(axis=(0, 1, 2)), [255, 0, 0], atol=3)
    np.testing.assert_allclose(np.asarray(Image.open(io.BytesIO(data))).mean(axis=(0, 1)), [0, 0, 255], atol=3)
    np.testing.assert_allclose(decode_color(data, 1).mean(axis=(0, 1, 2)), [255, 0, 0], atol=3)


@pytest.mark.parametrize("batch", [1, 3])
def test_pictures_are_the_bytes_that_the_benchmarks_client_sends(batch):
    pictures = smooth(batch)
    expected = cv2.imencode(".jpg", np.concatenate(list(pictures), axis=0))[1].tobytes()
    assert encode_color(pictures) == expected
    assert np.abs(benchmark_picture(expected, batch).astype(int) - pictures).mean() < 3.0
    np.testing.assert_array_equal(decode_color(expected, batch), benchmark_picture(expected, batch))


def test_depth_is_truncated_to_a_tenth_of_a_millimeter_and_saturates():
    metres = np.array([0.0, 0.00004, 0.5, 1.25, 6.5535, 6.5536, 10.0, np.inf, np.nan, -1.0], np.float32)
    data = encode_depth(np.tile(metres, (4, 1))[None])
    steps = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    assert steps.dtype == np.uint16
    assert steps.shape == (4, 10)
    assert steps[0].tolist() == [0, 0, 5000, 12500, 65535, 65535, 65535, 65535, 0, 0]
    assert decode_depth(data, 1)[0, 0, 6] == pytest.approx(6.5535)


@pytest.mark.parametrize("batch", [1, 2])
def test_depth_is_the_bytes_that_the_benchmarks_client_sends(batch):
    depth = np.random.default_rng(1).uniform(0.0, 8.0, (batch, 36, 64)).astype(np.float32)
    stacked = np.clip(np.concatenate(list(depth), axis=0) * 10000.0, 0, 65535.0).astype(np.uint16)
    data = encode_depth(depth)
    assert data == cv2.imencode(".png", stacked)[1].tobytes()
    np.testing.assert_array_equal(decode_depth(data, batch), benchmark_depth(data, batch))
    np.testing.assert_allclose(decode_depth(data, batch), np.minimum(depth, 6.5535), atol=1.1e-4)


def png_of(width: int, height: int) -> bytes:
    """A PNG that claims a size and has next to no data."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"\0" * 64)) + chunk(b"IEND", b"")
    )


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"nothing of the kind",
        encode_color(smooth())[:40],
        encode_depth(np.ones((1, 36, 64))),
        cv2.imencode(".bmp", smooth()[0])[1].tobytes(),
    ],
    ids=["empty", "text", "head alone", "a png", "a bmp"],
)
def test_data_that_are_not_a_jpeg_are_refused(data):
    with pytest.raises(WireError):
        decode_color(data, 1)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        encode_color(smooth()),
        cv2.imencode(".png", smooth()[0])[1].tobytes(),
        cv2.imencode(".png", smooth()[0][..., 0])[1].tobytes(),
        png_of(60_000, 60_000),
        png_of(2**31 - 1, 2**31 - 1),
    ],
    ids=["empty", "a jpeg", "colour", "8 bits", "huge", "beyond huge"],
)
def test_data_that_are_not_a_depth_image_are_refused(data):
    with pytest.raises(WireError):
        decode_depth(data, 1)


def test_an_image_whose_height_is_not_a_multiple_of_the_batch_is_refused():
    with pytest.raises(WireError, match="not a stack of 7"):
        decode_color(encode_color(smooth()), 7)


def test_the_intrinsic_matrix_has_the_field_of_view():
    matrix = intrinsic_matrix(640, 360, math.radians(68.0))
    left_edge = math.atan2(matrix[0, 2] - 0.0, matrix[0, 0])
    assert 2.0 * left_edge == pytest.approx(math.radians(68.0))
    assert (matrix[0, 2], matrix[1, 2]) == (320.0, 180.0)
    assert matrix[0, 0] == matrix[1, 1] == pytest.approx(474.4, abs=0.05)


AWKWARD = b"\r\n--boundary\r\n\r\n--\n\r\x00\xff--labgym-\r\n"


def test_the_standard_library_reads_our_forms():
    content_type, body = encode_form({"goal_data": '{"goal_x": [1]}'}, {"image": ("image.jpg", "image/jpeg", AWKWARD)})
    message = email.parser.BytesParser(policy=email.policy.HTTP).parsebytes(
        f"Content-Type: {content_type}\r\n\r\n".encode() + body
    )
    goal, image = message.iter_parts()
    assert goal.get_param("name", header="content-disposition") == "goal_data"
    assert goal.get_payload() == '{"goal_x": [1]}'
    assert image.get_filename() == "image.jpg"
    assert image.get_content_type() == "image/jpeg"
    assert decode_form(content_type, body) == {"goal_data": b'{"goal_x": [1]}', "image": AWKWARD}


@settings(max_examples=60, deadline=None)
@given(contents=st.lists(st.binary(max_size=200), min_size=1, max_size=6))
def test_any_bytes_survive_a_form(contents):
    files = {f"f{k}": ("x", "application/octet-stream", data) for k, data in enumerate(contents)}
    assert decode_form(*encode_form({}, files)) == {f"f{k}": data for k, data in enumerate(contents)}


def test_forms_of_other_libraries_are_read():
    body = (
        b'--x y\r\ncontent-disposition: form-data; filename="d.png"; name="depth"\r\ncontent-length: 3\r\n\r\nabc\r\n'
        b"--x y\r\nContent-Disposition: form-data; name=goal_data\r\n\r\n{}\r\n--x y--\r\n"
    )
    assert decode_form('multipart/form-data; charset=utf-8; boundary="x y"', body) == {
        "depth": b"abc",
        "goal_data": b"{}",
    }


PART = b'--b\r\nContent-Disposition: form-data; name="a"\r\n\r\nx\r\n'


@pytest.mark.parametrize(
    ("content_type", "body"),
    [
        ("", b""),
        ("application/json", b"{}"),
        ("multipart/form-data", PART + b"--b--\r\n"),
        ("multipart/form-data; boundary=" + "b" * 300, PART + b"--b--\r\n"),
        ("multipart/form-data; boundary=b", PART),
        ("multipart/form-data; boundary=b", b""),
        ("multipart/form-data; boundary=b", PART * (MAX_PARTS + 1) + b"--b--\r\n"),
        ("multipart/form-data; boundary=b", b"--b\r\nno header\r\n--b--\r\n"),
        ("multipart/form-data; boundary=b", b"--b\r\nX: y\r\n\r\nno name\r\n--b--\r\n"),
        ("multipart/form-data; boundary=b", b"--b\r\n" + b"X: y\r\n" * 5000 + b"\r\nx\r\n--b--\r\n"),
    ],
)
def test_a_body_that_is_not_a_form_is_refused(content_type, body):
    with pytest.raises(WireError):
        decode_form(content_type, body)
