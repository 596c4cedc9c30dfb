"""A description of splits: its figures follow from its rows, bars compare them, and it resumes."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from labgym.cli import main
from labgym.errors import OptionError, UnknownNameError
from labgym.eval.variety import describe as describing
from labgym.eval.variety.describe import describe_splits
from labgym.eval.variety.figures import DriveFigures, bars, group_figures
from labgym.eval.variety.rows import DriveRow, FloorRow, hood_walls
from labgym.eval.variety.sketch import FloorSketch, main_entrance, sketch_of
from labgym.eval.variety.tables import tables
from labgym.layouts import Layout, Placement, Room, load_published, published
from labgym.layouts.drives import entry_poses, places_of_work
from labgym.layouts.floors import SPLITS
from labgym.navigation import OBSTACLE_HEIGHT


def drive(length: float | None, detour: float = 1.2, neck: float = 1.0, accepted: bool = True, blind=None) -> DriveRow:
    known = length is not None
    return DriveRow(
        split="test",
        index=0,
        start=(0.0, 0.0, 0.0),
        goal=(1.0, 0.0, 0.0),
        start_location="a",
        goal_location="b",
        length=length,
        detour=detour if known else None,
        neck=neck - 0.1 if known else None,
        widest_neck=neck if known else None,
        accepted=accepted,
        blind=blind,
        blind_walls=blind,
    )


def floor(*hoods: str) -> FloorRow:
    return FloorRow(
        split="test",
        index=0,
        family="suite",
        seed=1,
        area=100.0,
        rooms=3,
        protocols=2,
        clutter=3,
        objects=200,
        hoods=hoods,
    )


def test_figures_are_counted_over_the_drives_with_a_path():
    rows = [drive(9.0, 1.3, 0.95), drive(5.0, 1.1, 0.89), drive(1.5, 1.0, 0.7), drive(None)]
    figures = DriveFigures.of(
        [row.model_copy(update={"blind": k == 0, "blind_walls": k < 2}) for k, row in enumerate(rows)]
    )
    assert (figures.drives, figures.unreachable, figures.short) == (4, 1, 1)
    assert figures.length == 5.0
    assert figures.detour_1 == pytest.approx(2 / 3, abs=1e-6)
    assert figures.detour_3 == pytest.approx(1 / 3, abs=1e-6)
    assert figures.neck == 1.0
    assert figures.widest_neck == pytest.approx(2 / 3, abs=1e-6)
    assert figures.blind == pytest.approx(1 / 3, abs=1e-6)
    assert figures.blind_walls == pytest.approx(2 / 3, abs=1e-6)


def test_bars_tell_what_is_reached():
    good = [drive(9.0, 1.4, 0.8, blind=False)] * 9 + [drive(9.0, blind=True)]
    refused = [drive(1.0, 1.0, accepted=False)] * 10
    group = group_figures("test", None, [floor("back", "left", "front", "right")], good + refused, [0.3, 0.4])
    assert group.acceptance == 0.5
    assert all(bar.reached for bar in bars(group))
    poor = [drive(7.9, 1.0, 1.2, blind=True)]
    group = group_figures("test", None, [floor("back", "back", "left", "right")], poor, [0.5])
    assert {bar.name: bar.reached for bar in bars(group)} == {bar.name: "under 2 m" in bar.name for bar in bars(group)}
    empty = group_figures("test", None, [floor()], [], [])
    assert [bar.reached for bar in bars(empty)].count(True) == 1


@pytest.mark.parametrize(("yaw", "wall"), [(math.pi, "back"), (0.0, "front"), (-math.pi / 2, "left"), (2.0, "right")])
def test_the_wall_behind_a_hood_is_named_from_the_main_door(yaw, wall):
    base = load_published("test", published("test")[0])
    room = Room(width=6.0, depth=5.0, doors=base.room.doors[:1])
    placement = Placement(id="FumeHood_1", asset="FumeHood", position=(3.0, 2.5, 0.0), yaw=yaw)
    assert hood_walls(Layout(id="one", protocols=(), floor=room.floor, placements=(placement,))) == [wall]


def test_a_sketch_has_the_walls_the_door_and_the_furniture_of_its_layout():
    layout = load_published("test", published("test")[0])
    sketch = FloorSketch.from_bytes(sketch_of(layout, layout).to_bytes())
    room, (x, y, yaw) = layout.room, sketch.entrance
    assert sketch.size == pytest.approx((room.width, room.depth))
    assert (x, y, yaw) == pytest.approx(main_entrance(layout).pose)
    assert len(sketch.furniture) == len(list(layout.obstacles(OBSTACLE_HEIGHT)))
    assert len(sketch.clutter) == 0
    for row, column in ((10, 20), (3, 3), (40, 50)):
        px, py = sketch.low + 0.1 * np.array([column, row])
        expected = max(0.0, min(px, py, room.width - px, room.depth - py))
        assert sketch.walls[row, column] == pytest.approx(expected, abs=2e-3)
    ((ex, ey, heading),) = list(entry_poses(layout).values())[:1]
    assert math.dist((ex, ey), (x, y)) == pytest.approx(0.6)
    assert (math.cos(heading), math.sin(heading)) == pytest.approx(((ex - x) / 0.6, (ey - y) / 0.6))
    assert set(places_of_work(layout)) == set(layout.protocol.locations)


def test_a_description_resumes_and_its_figures_are_those_of_its_rows(tmp_path, monkeypatch, capsys):
    """Four bays are generated, the fewest of which one is drawn before and one after an interruption: 3 s."""
    monkeypatch.setitem(SPLITS, "floors-train", SPLITS["floors-train"][:1])
    whole = describe_splits(("floors-train",), floors=2, episodes=4, progress=False)
    survey, calls = describing.survey, []

    def stopping(*arguments: object):
        if len(calls) == 1:
            raise KeyboardInterrupt
        calls.append(arguments)
        return survey(*arguments)

    monkeypatch.setattr(describing, "survey", stopping)
    with pytest.raises(KeyboardInterrupt):
        describe_splits(("floors-train",), floors=2, episodes=4, out=tmp_path, progress=False)
    calls.clear()
    monkeypatch.setattr(describing, "survey", survey)
    resumed = describe_splits(("floors-train",), floors=2, episodes=4, out=tmp_path, progress=False)
    assert resumed == whole
    assert describe_splits(("floors-train",), floors=2, episodes=4, out=tmp_path, progress=False) == whole
    rows = [json.loads(line) for line in (tmp_path / "drives.jsonl").read_text().splitlines()]
    lengths = [row["length"] for row in rows if row["accepted"]]
    total = whole.summary.groups[-1]
    assert (total.family, total.floors) == (None, 2)
    assert total.accepted.length == pytest.approx(np.median(lengths), abs=1e-6)
    assert total.accepted.drives == len(lengths) <= 8
    assert total.accepted.short == 0
    assert total.accepted.blind == pytest.approx(np.mean([r["blind"] for r in rows if r["accepted"]]), abs=1e-6)
    walls = [r["blind_walls"] for r in rows if r["accepted"]]
    assert total.accepted.blind_walls == pytest.approx(np.mean(walls), abs=1e-6)
    text = "\n".join(table.text() for table in tables(whole.summary))
    assert "Bars of split floors-train" in text
    assert "1 floors: by its place" in text


def test_what_cannot_be_described_is_refused_in_one_line(capsys):
    with pytest.raises(UnknownNameError, match="floors-seen"):
        describe_splits(("validation",))
    for wrong in ({"floors": 1}, {"episodes": 0}, {"seed": 10**9}):
        with pytest.raises(OptionError, match=next(iter(wrong))):
            describe_splits(**wrong)
    assert main(["describe", "splits", "--floors", "1"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
