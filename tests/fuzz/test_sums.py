"""Small files that would fill the memory are refused in one line: the kernel's counters of a process are the oracle."""

from __future__ import annotations

import io
import json
import os
import resource
import struct
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fuzz.harness import MIB, memory
from labgym.assets.archive import unpack
from labgym.errors import LabgymError
from labgym.eval.variety.sketch import FloorSketch
from labgym.protocols.importers.records import UnreadableError


def tensors(path: Path) -> None:
    """A safetensors file of half a million empty tensors."""
    entry = {"dtype": "F32", "shape": [0], "data_offsets": [0, 0]}
    header = json.dumps({f"t{k}": entry for k in range(500_000)}).encode()
    path.write_bytes(struct.pack("<Q", len(header)) + header)


def zeros(path: Path, members: dict[str, int]) -> None:
    """A zip archive whose members are zeros; sizes in MB."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, size in members.items():
            with archive.open(name, "w", force_zip64=True) as stream:
                for _ in range(size):
                    stream.write(bytes(MIB))


def actor(folder: Path) -> Callable[[], Any]:
    from labgym.policies.adapters.actor_file import Perceptron

    tensors(folder / "a.safetensors")
    return lambda: Perceptron.load(folder / "a.safetensors")


def weights(folder: Path) -> Callable[[], Any]:
    import torch

    from labgym.policies.learned.weights import load_weights

    tensors(folder / "weights.safetensors")
    return lambda: load_weights(torch.nn.Linear(1, 1), folder)


def checkpoint(folder: Path) -> Callable[[], Any]:
    import torch

    from labgym.policies.learned.checkpoint import load_checkpoint

    zeros(folder / "c.pt", {"c/data.pkl": 1, "c/data/0": 1200, "c/version": 1})
    return lambda: load_checkpoint(folder / "c.pt", {"a": torch.nn.Linear(1, 1)}, lambda record: True)


def geometry(folder: Path) -> Callable[[], Any]:
    zeros(folder / "g.npz", {"materials.npy": 1, "vertices_0.npy": 500})
    return lambda: unpack((folder / "g.npz").read_bytes(), "g.npz")


def sketch(folder: Path) -> Callable[[], Any]:
    zeros(folder / "s.npz", {"walls.npy": 500})
    return lambda: FloorSketch.from_bytes((folder / "s.npz").read_bytes())


def other_sketch(folder: Path) -> Callable[[], Any]:
    stream = io.BytesIO()
    np.savez(stream, walls=np.zeros(3))
    return lambda: FloorSketch.from_bytes(stream.getvalue())


def picture(folder: Path) -> Callable[[], Any]:
    from PIL import Image

    from labgym.policies.http.client import read_picture

    Image.new("1", (12_000, 12_000)).save(folder / "p.png")
    return lambda: read_picture(folder / "p.png")


def program(folder: Path) -> Callable[[], Any]:
    """An EPS picture, which Pillow would pass to Ghostscript."""
    from labgym.policies.http.client import read_picture

    (folder / "p.png").write_text("%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 100 100\n%%EndComments\n")
    return lambda: read_picture(folder / "p.png")


def script(folder: Path) -> Callable[[], Any]:
    """A TorchScript file with a text of 1.8 GB by its own account."""
    import torch

    from labgym.policies.adapters.torchscript import TorchScriptPolicy

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.jit.script(torch.nn.Linear(3, 2)).save(str(folder / "seed.pt"))
    with zipfile.ZipFile(folder / "seed.pt") as seed, zipfile.ZipFile(folder / "s.pt", "w") as archive:
        for name in seed.namelist():
            longer = (b"X\x08\0\0\0training", b"X\x08\0\0\x69training")
            archive.writestr(name, seed.read(name).replace(*longer))
    return lambda: TorchScriptPolicy(folder / "s.pt", trust=True)


def reactions(folder: Path) -> Callable[[], Any]:
    """A value of 20 MB, stored once, in each of 50 rows."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    from labgym.protocols.importers import ord_files

    table = pa.table({"reaction": pa.array([bytes(20 * MIB)] * 50, pa.binary())})
    pq.write_table(table, folder / "o.parquet", compression="zstd", dictionary_pagesize_limit=1 << 30)

    def read() -> None:
        for parse in ord_files.reactions(folder / "o.parquet"):
            with pytest.raises(UnreadableError):
                parse()
        raise LabgymError("each reaction is too large")

    return read


CASES = (actor, weights, checkpoint, geometry, sketch, other_sketch, picture, program, script, reactions)


@pytest.mark.cases(4)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_a_small_file_does_not_fill_the_memory(tmp_path: Path, case: Callable[[Path], Callable[[], Any]]) -> None:
    pytest.importorskip("torch")
    pytest.importorskip("pyarrow")
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(writing, json.dumps(measured(case(tmp_path))).encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as stream:
        message, growth, seconds = json.loads(stream.read())
    os.waitpid(child, 0)
    assert message
    assert len(message.splitlines()) == 1
    assert growth < 750
    assert seconds < 10


def measured(read: Callable[[], Any]) -> tuple[str, float, float]:
    """Return the LabgymError of a reader, and the memory (MiB) and processor time (s) that it took."""
    before, message = memory("VmRSS"), ""
    Path("/proc/self/clear_refs").write_text("5")  # resets the peak
    begun = resource.getrusage(resource.RUSAGE_SELF)
    try:
        read()
    except LabgymError as error:
        message = str(error)
    except BaseException as error:  # noqa: BLE001 - it is reported
        message = f"a {type(error).__name__} of\nseveral lines: {error}"
    ended = resource.getrusage(resource.RUSAGE_SELF)
    seconds = ended.ru_utime + ended.ru_stime - begun.ru_utime - begun.ru_stime
    return message, (memory("VmHWM") - before) / MIB, seconds
