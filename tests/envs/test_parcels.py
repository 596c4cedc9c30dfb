"""Prepared layouts in shared memory."""

from __future__ import annotations

import gc
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.envs.parcels import SHARED, Parcel
from labgym.envs.stage import LayoutSenses
from labgym.envs.world import World

pytestmark = pytest.mark.skipif(not SHARED, reason="needs memory files, which this system does not have")


@pytest.fixture(scope="module")
def stage():
    return World(island_laboratory()).stage(LayoutSenses())


def test_a_stage_arrives_as_it_was_sent(stage):
    parcel = Parcel.of(stage)
    arrived = Parcel.at(pickle.loads(pickle.dumps(parcel.address))).stage()
    assert (arrived.layout, arrived.lengths, arrived.nbytes) == (stage.layout, stage.lengths, stage.nbytes)
    assert pickle.dumps(arrived.model) == pickle.dumps(stage.model)
    for name in ("vertices", "faces", "material", "owner"):
        assert getattr(arrived.mesh, name).tobytes() == getattr(stage.mesh, name).tobytes()
    for ends, field in stage.to_go.items():
        assert arrived.to_go[ends].at(2.0, 3.0) == field.at(2.0, 3.0)


def test_what_one_process_writes_no_other_sees(stage):
    parcel = Parcel.of(stage)
    arrived = parcel.stage()
    arrived.mesh.vertices[:] = 0.0
    assert np.array_equal(parcel.stage().mesh.vertices, stage.mesh.vertices)


def test_a_stage_outlives_its_parcel_and_closing_leaves_no_open_file(stage):
    before = set(Path("/proc/self/fd").iterdir())
    parcel = Parcel.of(stage)
    arrived = parcel.stage()
    address = parcel.address
    parcel.close()
    parcel.close()
    assert np.array_equal(arrived.mesh.vertices, stage.mesh.vertices)
    with pytest.raises(OSError, match=str(address.descriptor)):
        Parcel.at(address)
    del arrived, parcel
    gc.collect()
    assert set(Path("/proc/self/fd").iterdir()) <= before


@pytest.mark.parametrize("content", [b"", b"x" * 20, b"\0" * 5000])
def test_another_file_at_the_address_is_refused(stage, content, tmp_path: Path):
    (tmp_path / "other").write_bytes(content)
    parcel = Parcel.of(stage)
    with (tmp_path / "other").open("rb") as file:
        other = Parcel.at(replace(parcel.address, descriptor=file.fileno()))
        with pytest.raises(OSError, match=r"not (a|the) prepared layout"):
            other.stage()
