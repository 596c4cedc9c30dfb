"""Plans of floors of any shape: walls, openings, columns and names are where the floor has them."""

from __future__ import annotations

import io
import math

import furnished_floors as floors
import numpy as np
import pytest
import shapely
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.image import imread

from labgym.eval.drawing import palette
from labgym.eval.drawing.floor_drawing import swings
from labgym.eval.drawing.pictures import picture_bytes, topdown
from labgym.layouts import Layout


def color(text: str) -> np.ndarray:
    return np.array([int(text[k : k + 2], 16) / 255 for k in (1, 3, 5)])


class Picture:
    """A plan as pixels, and the scale and place of its drawing by matplotlib."""

    def __init__(self, layout: Layout) -> None:
        self.figure = topdown(layout)
        self.image = imread(io.BytesIO(picture_bytes(self.figure)), format="png")[:, :, :3]
        self.texts = {text.get_text(): text.get_position() for text in self.figure.axes[0].texts}

    def at(self, x: float, y: float) -> np.ndarray:
        height, width = self.image.shape[:2]
        axes = self.figure.axes[0]
        box, (x0, x1), (y0, y1) = axes.get_position(), axes.get_xlim(), axes.get_ylim()
        column = (box.x0 + (x - x0) / (x1 - x0) * box.width) * width
        row = (1.0 - box.y0 - (y - y0) / (y1 - y0) * box.height) * height
        return self.image[round(row), round(column)]


@pytest.fixture(scope="module")
def suite() -> Picture:
    return Picture(floors.furnished("suite"))


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        ((5.0, 3.9), "#ffffff"),  # beside the line of the glazed part
        ((6.5, 3.9), palette.WALL),
        ((2.5, 5.9), "#ffffff"),  # the passage
        ((10.0, 3.9), "#ffffff"),  # the closed door, drawn open
        ((-0.1, 4.9), "#ffffff"),  # the exit
        ((-0.1, 3.0), palette.WALL),
        ((8.0, 2.0), palette.WALL),
        ((3.6, 4.55), palette.FLOOR),
        ((12.3, 7.7), palette.FLOOR),
        ((1.2, 0.16), palette.HOOD.fill),
    ],
)
def test_colors_of_a_suite_are_those_of_its_parts(suite: Picture, place: tuple[float, float], expected: str) -> None:
    x, y = place
    shift = 0.05 if place == (5.0, 3.9) else 0.0
    assert suite.at(x, y + shift) == pytest.approx(color(expected), abs=0.02)


def test_spaces_are_named_where_their_name_covers_nothing(suite: Picture) -> None:
    layout = floors.furnished("suite")
    boxes = shapely.union_all([shapely.Polygon(layout.box(p.id).corners()) for p in layout.placements])
    for space in layout.floor.spaces:
        x, y = suite.texts[space.id]
        assert layout.floor.space_at(x, y) == space
        assert boxes.distance(shapely.Point(x, y)) > 0.1


def test_names_of_furniture_and_of_spaces_do_not_overlap() -> None:
    figure = topdown(floors.furnished("suite"))
    canvas = FigureCanvasAgg(figure)
    axes = figure.axes[0]
    texts = [text for text in axes.texts if len(text.get_text()) > 1]
    boxes = [shapely.box(*text.get_window_extent(canvas.get_renderer()).extents).buffer(-1.0) for text in texts]
    assert len(texts) > 20
    for k, box in enumerate(boxes):
        for other in boxes[k + 1 :]:
            assert not box.intersects(other)


def test_columns_and_oblique_walls_are_drawn_in_place() -> None:
    layout = floors.furnished("oblique")
    picture = Picture(layout)
    for box in [part.box for part in layout.floor.parts if part.kind in ("column", "wall") and part.box.width > 0.3]:
        for u in (-0.3, 0.3):
            x, y = box.to_world(u * box.width, 0.0)
            assert picture.at(x, y) == pytest.approx(color(palette.WALL), abs=0.02)


def test_the_sweep_of_a_leaf_reaches_its_width_from_the_hinge() -> None:
    floor = floors.suite()
    bounds = swings(floor)
    assert len(bounds) == 6
    # The door at x = 1.5 to 2.5 of the wall at y = 3.9 opens down from its face at y = 3.8.
    assert min(bounds, key=lambda b: math.dist(b[:2], (1.5, 2.8))) == pytest.approx((1.5, 2.8, 2.5, 3.8), abs=1e-9)


def test_the_panel_gives_the_number_of_spaces_and_the_size() -> None:
    figure = topdown(floors.furnished("suite"))
    assert any("6 spaces, 14.4 x 10.4 m" in text.get_text() for text in figure.axes[1].texts)


def test_the_same_floor_gives_the_same_bytes() -> None:
    one, other = (picture_bytes(topdown(floors.furnished("ell")), "svg") for _ in range(2))
    assert one == other
