"""Details that many shapes share: feet, knobs, screens, handles, vents, castors, keypads."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.assets.shapes.parts import ALONG_X, ALONG_Y, Part, Point, block, column, cylinder, rod


def feet(x: float, y: float, height: float, diameter: float = 0.022) -> Iterator[Part]:
    """Four rubber feet at (+-x, +-y)."""
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            yield column("rubber", diameter, sx * x, sy * y, (0.0, height))


def castors(x: float, y: float, height: float) -> Iterator[Part]:
    """Four castor wheels at (+-x, +-y), `height` tall."""
    wheel = height * 0.75
    for sx in (-1.0, 1.0):
        for sy in (-1.0, 1.0):
            yield cylinder("rubber", wheel, 0.025, (sx * x, sy * y, wheel / 2.0), ALONG_X)
            yield column("galvanised", 0.03, sx * x, sy * y, (wheel, height))


def knob(material: str, diameter: float, x: float, y: float, front: float, z: float) -> Iterator[Part]:
    """A round knob on a front at y, reaching `front`, with a pointer."""
    middle = y + 0.8 * (front - y)
    yield cylinder(material, diameter, middle - y, (x, (y + middle) / 2.0, z), ALONG_Y)
    yield block("print_black", (x - 0.0015, x + 0.0015), (middle - 0.001, front), (z, z + diameter * 0.45))


def panel_screen(material: str, x: Point, y: float, z: Point) -> Iterator[Part]:
    """A display with a dark bezel on a front at y; it stands 3 mm proud."""
    edge = 0.004
    yield block("screen_dark", (x[0] - edge, x[1] + edge), (y - 0.001, y + 0.002), (z[0] - edge, z[1] + edge))
    yield block(material, x, (y, y + 0.003), z)


def curve_screen(x: Point, y: float, z: Point) -> Iterator[Part]:
    """A large display that shows a measured curve as a row of bars; it stands 4 mm proud."""
    yield from panel_screen("screen_dark", x, y, z)
    width, height = x[1] - x[0], z[1] - z[0]
    peaks = (0.10, 0.12, 0.55, 0.16, 0.12, 0.82, 0.30, 0.14, 0.42, 0.12, 0.10)
    pitch = 0.9 * width / len(peaks)
    for k, peak in enumerate(peaks):
        # The front is seen with +x to its left, so the first bar sits at the right end.
        left = x[1] - 0.05 * width - (k + 1) * pitch
        yield block(
            "screen",
            (left, left + 0.7 * pitch),
            (y + 0.003, y + 0.004),
            (z[0] + 0.1 * height, z[0] + height * (0.1 + 0.8 * peak)),
        )


def keypad(x: Point, y: float, z: Point, columns: int = 3, rows: int = 4) -> Iterator[Part]:
    """A pad of keys on a front at y; it stands 3 mm proud."""
    pitch_x, pitch_z = (x[1] - x[0]) / columns, (z[1] - z[0]) / rows
    for i in range(columns):
        for j in range(rows):
            left, low = x[0] + i * pitch_x, z[0] + j * pitch_z
            colour = "abs_green" if (i, j) == (0, 0) else "plastic_dark"
            yield block(
                colour,
                (left + 0.15 * pitch_x, left + 0.85 * pitch_x),
                (y, y + 0.003),
                (low + 0.15 * pitch_z, low + 0.85 * pitch_z),
            )


def bar_handle(x: float, y: float, front: float, z: Point, material: str = "stainless") -> Iterator[Part]:
    """An upright bar handle on a door at y, its outside at `front`."""
    thick = min(0.014, (front - y) * 0.7)
    yield rod(material, thick, (x, front - thick / 2.0, z[0]), (x, front - thick / 2.0, z[1]))
    for height in (z[0] + 0.02, z[1] - 0.02):
        yield block(
            material, (x - thick * 0.35, x + thick * 0.35), (y, front - thick / 2.0), (height - 0.006, height + 0.006)
        )


def drawer_handle(x: Point, y: float, front: float, z: float, material: str = "stainless") -> Iterator[Part]:
    """A level bar handle on a drawer front at y, its outside at `front`."""
    thick = min(0.012, (front - y) * 0.6)
    yield block(material, x, (front - thick, front), (z - thick / 2.0, z + thick / 2.0))
    for end in (x[0] + 0.01, x[1] - 0.01):
        yield block(material, (end - 0.004, end + 0.004), (y, front - thick), (z - 0.004, z + 0.004))


def louvres(x: Point, y: float, z: Point, count: int) -> Iterator[Part]:
    """Dark ventilation slots on a front at y; they stand 1 mm proud."""
    pitch = (z[1] - z[0]) / count
    for k in range(count):
        low = z[0] + (k + 0.3) * pitch
        yield block("plastic_black", x, (y - 0.001, y + 0.001), (low, low + 0.4 * pitch))


def gauge(x: float, y: float, front: float, z: float, diameter: float) -> Iterator[Part]:
    """A dial gauge on a front at y, its glass at `front`."""
    yield cylinder("chrome", diameter, front - y - 0.001, (x, (y + front - 0.001) / 2.0, z), ALONG_Y)
    yield cylinder("paper", diameter * 0.84, front - y - 0.0005, (x, (y + front - 0.0005) / 2.0, z), ALONG_Y)
    yield block("print_red", (x - 0.001, x + 0.001), (front - 0.002, front + 0.0), (z, z + diameter * 0.36))
