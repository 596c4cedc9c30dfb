"""Films of LabNav episodes: the robot from behind and above, and a panel with its map, its camera and the counts."""

from __future__ import annotations

import io
from collections.abc import Container, Iterator

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from labgym.envs.conditions.bodies import BodyRays
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import Camera
from labgym.envs.state import Pose
from labgym.envs.tasks import Task
from labgym.envs.view import ChaseView
from labgym.errors import OptionError
from labgym.eval.drawing import palette
from labgym.eval.drawing.changed_plan import CHANGED, PUSHED
from labgym.eval.drawing.episode_plan import (
    DRIVEN,
    PERSON,
    ROBOT_COLOR,
    SHOULDERS,
    UNSEEING,
    arrowhead,
    draw_map,
    draw_route,
    nose,
    people_of,
    route_of,
)
from labgym.eval.drawing.film import Picture
from labgym.eval.drawing.palette import font, rgb
from labgym.eval.labnav.replay import Replay, Shot
from labgym.scenes import Quality, RayScene

PANEL = 0.34
"""Width of the panel relative to the picture's."""
SMALLEST = (480, 270)
"""Smallest film, pixels."""
MARGIN = 10
"""Margin of the panel, pixels."""
HOLD = 15
"""Pictures for which the last one stays: 1.5 s."""
PASSENGERS = ("beaker",)
"""Bodies on the robot, which its own camera does not see."""
FINE = 4
"""Fractional bits of the coordinates of drawn shapes."""

Array = NDArray[np.float64]


def episode_film(
    shown: Replay, width: int = 960, height: int = 540, quality: Quality = "fast", steps: Container[int] | None = None
) -> Iterator[Picture]:
    """Yield a picture (height, width, 3) for each control step of an episode; the last one is repeated for 1.5 s.

    Args:
        shown: the episode. width, height: of the film, pixels.
        quality: "fast", or "fine" with shadows and reflections, which takes about ten times as long without a GPU.
        steps: numbers of the control steps that are shown, without repetition of the last one; by default all.

    Raises:
        OptionError: the film is too small, or larger than the scene's off-screen buffer.
        MissingRendererError: OpenGL is not available.
    """
    check_episode_film_size(width, height)
    side = round(PANEL * width)
    rays, camera, view = RayScene(shown.fixtures, "visual"), Camera(), ChaseView(width - side, height, quality)
    panel = FilmPanel(shown, side, height)
    whole: Picture | None = None
    try:
        for step, shot in enumerate(shown.shots):
            panel.moved(shot.pose)
            if steps is not None and step not in steps:
                continue
            chase = view.picture(shown.fixtures, rays, shot.pose, bodies=shot.bodies)
            seen = [body for body in shot.bodies if body.name not in PASSENGERS]
            color, _ = camera.colour_and_depth(BodyRays(rays, len(rays.mesh.faces), seen), shot.pose)
            whole = np.hstack([chase, panel.picture(step, shot, color)])
            yield whole
        for _ in range(HOLD if whole is not None and steps is None else 0):
            assert whole is not None
            yield whole
    finally:
        view.close()


def check_episode_film_size(width: int, height: int) -> None:
    """Raise OptionError if an episode's film of that size, pixels, is too small."""
    if width < SMALLEST[0] or height < SMALLEST[1]:
        raise OptionError(f"film size {width}x{height} is too small; the minimum is {SMALLEST[0]}x{SMALLEST[1]}")


class FilmPanel:
    """The panel of a film: title, map, camera and counts.

    Args:
        shown: the episode. width, height: pixels.
    """

    def __init__(self, shown: Replay, width: int, height: int) -> None:
        self._shown, self._size = shown, (width, height)
        inner = width - 2 * MARGIN
        self._line = max(12, round(height / 30))
        top = MARGIN + round(3.2 * self._line)
        view = (inner, inner * 9 // 16)
        room = height - top - view[1] - round(3.6 * self._line) - 2 * MARGIN
        self._camera = MARGIN, height - round(3.6 * self._line) - view[1], *view
        self._map, self._transform = _map_picture(shown.task, inner, max(room, 40))
        rows, columns = self._map.shape[:2]
        self._corner = MARGIN + (inner - columns) // 2, top + max(0, (room - rows) // 2)
        self._base = self._background()
        self._trail: list[Pose] = []

    def moved(self, pose: Pose) -> None:
        """Add a pose to the way that was driven."""
        self._trail.append(pose)

    def picture(self, step: int, shot: Shot, color: Picture) -> Picture:
        """Return the panel at a control step, (height, width, 3)."""
        picture = self._base.copy()
        left, top = self._corner
        rows, columns = self._map.shape[:2]
        here = self._map.copy()
        self._draw_map(here, shot)
        picture[top : top + rows, left : left + columns] = here
        x, y, width, height = self._camera
        picture[y : y + height, x : x + width] = cv2.resize(color, (width, height), interpolation=cv2.INTER_LINEAR)
        return self._captioned(picture, step, shot)

    def _draw_map(self, picture: Picture, shot: Shot) -> None:
        task = self._shown.task
        if len(self._trail) > 1:
            cv2.polylines(
                picture, [self._pixels(np.array(self._trail)[:, :2])], False, rgb(DRIVEN), 2, cv2.LINE_AA, FINE
            )
        for body in shot.bodies:
            if body.name in task.pushable:
                box = task.layout.box(body.name)
                corners = self._pixels(_outline(body.pose, box.width, box.depth))
                cv2.fillPoly(picture, [corners], rgb(PUSHED), cv2.LINE_AA, FINE)
                cv2.polylines(picture, [corners], True, rgb(CHANGED), 1, cv2.LINE_AA, FINE)
        for person in people_of(task, shot.bodies):
            shade = rgb(PERSON if person.yields else UNSEEING)
            self._disc(picture, person.pose[:2], SHOULDERS, shade)
            cv2.fillPoly(picture, [self._pixels(nose(person.pose, SHOULDERS))], shade, cv2.LINE_AA, FINE)
        self._disc(picture, shot.pose[:2], 1.25 * ROBOT.chassis_radius, (255, 255, 255))
        tip = self._pixels(arrowhead(shot.pose, 1.4 * ROBOT.chassis_radius))
        cv2.fillPoly(picture, [tip], rgb(CHANGED if shot.touched else ROBOT_COLOR), cv2.LINE_AA, FINE)

    def _disc(self, picture: Picture, place: tuple[float, float], radius: float, color: tuple[int, int, int]) -> None:
        (x, y), scale = self._pixels(np.array([place]))[0].tolist(), self._transform[0]
        cv2.circle(picture, (x, y), round(radius * scale * 2**FINE), color, -1, cv2.LINE_AA, FINE)

    def _pixels(self, points: Array) -> NDArray[np.int32]:
        """Return points (n, 2), meters, in pixels of the map with `FINE` fractional bits."""
        scale, left, top = self._transform
        places = np.column_stack([(points[:, 0] - left) * scale, (top - points[:, 1]) * scale])
        return np.asarray(np.rint((places - 0.5) * 2**FINE), dtype=np.int32)

    def _background(self) -> Picture:
        width, height = self._size
        image = Image.new("RGB", (width, height), "#ffffff")
        draw, row = ImageDraw.Draw(image), self._shown.row
        draw.text((MARGIN, MARGIN), f"{row.task}-{row.level}", palette.INK, font(round(1.35 * self._line), True))
        small = font(round(0.82 * self._line), False)
        words = f"{row.policy}   {row.floor}, episode {row.number}"
        draw.text((MARGIN, MARGIN + round(1.8 * self._line)), words, palette.MUTED, small)
        return np.array(image)

    def _captioned(self, picture: Picture, step: int, shot: Shot) -> Picture:
        image = Image.fromarray(picture)
        row, y = self._shown.row, self._size[1] - round(3.0 * self._line)
        goal = f"goal {shot.leg + 1}" if self._shown.task.following else "goal"
        words = f"{step * ROBOT.control_dt:.1f} s   {goal} {shot.distance:.1f} m"
        if shot.rise is not None:
            words += f"   liquid {1e3 * shot.rise:.0f} mm"
        self._write(image, y, words, palette.INK)
        y += round(1.4 * self._line)
        if step == len(self._shown.shots) - 1:
            ending = f"{row.ending}: {row.contact}" if row.contact else row.ending
            self._write(
                image, y, f"{ending}   score {row.score:.2f}", "#2c7a3f" if row.ending == "success" else "#b3261e", True
            )
        elif shot.touched:
            self._write(image, y, f"touches {shot.touched[0]}", "#b3261e")
        return np.array(image)

    def _write(self, image: Image.Image, y: int, words: str, color: str, bold: bool = False) -> None:
        """Write a line in the largest font, up to the panel's, in which it fits."""
        draw, room = ImageDraw.Draw(image), self._size[0] - 2 * MARGIN
        size = self._line
        while size > 6 and draw.textlength(words, font(size, bold)) > room:
            size -= 1
        draw.text((MARGIN, y), words, color, font(size, bold))


def _map_picture(task: Task, width: int, height: int) -> tuple[Picture, tuple[float, float, float]]:
    """Return the map of an episode in a rectangle of pixels, with pixels per meter and the left and upper bounds."""
    from matplotlib.figure import Figure

    x0, y0, x1, y1 = task.layout.floor.bounds
    scale = min(width / (x1 - x0), height / (y1 - y0))
    columns, rows = max(1, round((x1 - x0) * scale)), max(1, round((y1 - y0) * scale))
    dpi = 55
    figure = Figure(figsize=(columns / dpi, rows / dpi), dpi=dpi, facecolor="#ffffff")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), frameon=False)
    axes.set_axis_off()
    draw_map(axes, task, loose=False)
    draw_route(axes, task, route_of(task))
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=2 * dpi)
    drawn = Image.open(stream).convert("RGB").resize((columns, rows), Image.Resampling.LANCZOS)
    return np.array(drawn), (scale, x0, y1)


def _outline(pose: Pose, width: float, depth: float) -> Array:
    """Return the corners (4, 2) of a rectangle whose middle is at a pose, meters."""
    x, y, yaw = pose
    half = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]) * (width / 2.0, depth / 2.0)
    cosine, sine = np.cos(yaw), np.sin(yaw)
    return np.asarray(half @ np.array([[cosine, sine], [-sine, cosine]]) + (x, y))
