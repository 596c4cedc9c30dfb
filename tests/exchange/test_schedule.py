"""The schedule of services: every object with a need, its demand, and the service point that it is connected to."""

from __future__ import annotations

import csv

import pytest
from laboratories import put

from labgym.exchange.schedule import demands, write_schedule
from labgym.layouts import Layout
from labgym.layouts.floor import Floor, Service


def laboratory(**changes) -> Layout:
    floor = Floor.rectangle(8.0, 6.0).model_copy(
        update={
            "services": (Service(kind="water", x=1.0, y=5.9, z=0.6), Service(kind="exhaust", x=7.9, y=0.1, z=2.9)),
            **changes,
        }
    )
    hood = put("FumeHood_1", "FumeHood", 4.0, 5.5, yaw=3.14159265)
    sink = put("SinkBench_1", "SinkBench", 1.0, 5.6, yaw=3.14159265)
    stirrer = put("Stirrer_1", "MagneticHotplateStirrer", 4.0, 5.5, 0.9, on="FumeHood_1", slot=0)
    return Layout(id="lab", floor=floor, placements=(hood, sink, stirrer))


def test_needs_distances_and_states_follow_from_the_layout():
    rows = {(each.service, each.id): each for each in demands(laboratory())}
    assert set(rows) == {
        ("power", "FumeHood_1"), ("power", "Stirrer_1"), ("water", "SinkBench_1"), ("exhaust", "FumeHood_1"),
    }  # fmt: skip
    sink, hood = rows["water", "SinkBench_1"], rows["exhaust", "FumeHood_1"]
    assert (sink.status, sink.distance, sink.space) == ("connected", 0.0, "laboratory")
    assert hood.status == "out of reach"
    assert rows["power", "Stirrer_1"].status == "no point"


def test_the_air_of_a_hood_is_its_face_velocity_times_its_opening(tmp_path):
    layout = laboratory()
    hood = layout.asset("FumeHood_1")
    flow = hood.specs.face_velocity_m_s * hood.specs.sash_open_m * hood.cavity.width * 3600.0
    rows = list(csv.DictReader(write_schedule(layout, tmp_path / "a.csv").open()))
    (line,) = [row for row in rows if (row["service"], row["id"]) == ("exhaust", "FumeHood_1")]
    assert float(line["demand"]) == pytest.approx(flow, rel=1e-3)
    assert line["unit"] == "m3/h"
    watts = [float(row["demand"]) for row in rows if row["service"] == "power" and row["demand"]]
    assert watts[-1] == sum(watts[:-1]) == layout.asset("Stirrer_1").specs.power_W


def test_points_are_in_the_frame_of_the_file(tmp_path):
    rows = list(csv.DictReader(write_schedule(laboratory(origin=(-100.0, 20.0, 0.0)), tmp_path / "a.csv").open()))
    (line,) = [row for row in rows if row["id"] == "SinkBench_1"]
    assert (float(line["x_m"]), float(line["y_m"]), float(line["z_m"])) == pytest.approx((-99.0, 25.9, 0.6))
