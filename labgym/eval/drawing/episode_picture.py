"""The picture of a LabNav episode: its plan next to a rendered view."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from labgym.documents import write_bytes
from labgym.envs.conditions.panes import FRAMED, FRAMELESS
from labgym.envs.labnav.episodes import LabNavEpisode
from labgym.envs.labnav.nuisances import people_at_start, prepared
from labgym.envs.labnav.tasks import task_of
from labgym.envs.tasks import Task
from labgym.errors import OptionError
from labgym.eval.drawing import palette
from labgym.eval.drawing.changed_plan import CHANGED, GONE, PUSHED
from labgym.eval.drawing.episode_plan import (
    GOAL,
    NECK,
    PANE,
    PERSON,
    ROBOT_COLOR,
    ROUTE,
    UNSEEING,
    draw_world,
    neck_of,
    people_of,
    route_of,
)
from labgym.eval.drawing.episode_view import episode_view, spot_of
from labgym.eval.drawing.palette import font, rgb
from labgym.layouts import Layout

PLAN = 0.62
"""Width of the plan relative to that of the rendered view."""
AROUND, DOCKING = 1.4, 3.0
"""Least distance between the route and the edge of the plan, and way before a docking pose that is drawn, meters."""
HEAD, FOOT = 0.16, 0.085
"""Heights of title and legend relative to that of the rendered view."""
DPI = 100
SUFFIXES = {".png": "png", ".jpg": "jpeg", ".jpeg": "jpeg"}

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EpisodeWorld:
    """An episode and its world before the start.

    Attributes:
        name, level: of the task. episode: the episode. task: after its conditions.
    """

    name: str
    level: int
    episode: LabNavEpisode
    task: Task

    @classmethod
    def of(cls, name: str, level: int, episode: LabNavEpisode, layout: Layout) -> EpisodeWorld:
        """Return the world of an episode on its floor.

        Raises:
            OptionError: the data of a condition is not of this layout.
        """
        return cls(name, level, episode, prepared(name, level, episode, layout))


def episode_picture(world: EpisodeWorld, width: int = 900, height: int = 560, samples: int = 8) -> Image.Image:
    """Return the plan of an episode next to a rendered view, with title and legend.

    Args:
        width, height: of the rendered view, pixels. samples: rays per pixel.

    Raises:
        OptionError: the size is below 320x240 or above 2560x1440.
    """
    check_episode_size(width, height)
    task, people = world.task, people_at_start(world.task)
    route = route_of(task)
    side, head, foot = round(PLAN * width), round(HEAD * height), round(FOOT * height)
    picture = Image.new("RGB", (side + width, head + height + foot), "#ffffff")
    _write_title(picture, world, head)
    picture.paste(_plan(task, route, side, height), (0, head))
    picture.paste(Image.fromarray(episode_view(task, route, people, width, height, samples)), (side, head))
    _write_legend(picture, _legend(task), head + height, foot)
    return picture


def check_episode_size(width: int, height: int) -> None:
    """Raise OptionError if a rendered view of that size, pixels, is too small or too large."""
    if not (320 <= width <= 2560 and 240 <= height <= 1440):
        raise OptionError(f"view size {width}x{height} is not between 320x240 and 2560x1440")


def save_episode_picture(picture: Image.Image, path: str | Path) -> Path:
    """Write a picture as PNG or JPEG, by the path's suffix."""
    path = Path(path)
    check_picture_path(path)
    stream = io.BytesIO()
    picture.save(stream, SUFFIXES[path.suffix], optimize=True, **({} if path.suffix == ".png" else {"quality": 88}))
    return write_bytes(path, stream.getvalue())


def check_picture_path(path: Path) -> None:
    """Raise OptionError if a path does not end in .png or .jpg."""
    if path.suffix not in SUFFIXES:
        raise OptionError(f"picture {path.name!r} must end in .png or .jpg")


def _plan(task: Task, route: Array, width: int, height: int) -> Image.Image:
    """Return the plan of the part of the floor around the route."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="#ffffff")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), frameon=False)
    axes.set_axis_off()
    people = people_at_start(task)
    spot = spot_of(task, route, people)
    draw_world(axes, task, route, people_of(task, people), "parked" in task.conditions, spot.robot)
    x0, y0, x1, y1 = _window(task, route, width / height)
    axes.set_xlim(x0, x1)
    axes.set_ylim(y0, y1)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=2 * DPI)
    return Image.open(stream).convert("RGB").resize((width, height), Image.Resampling.LANCZOS)


def _window(task: Task, route: Array, aspect: float) -> tuple[float, float, float, float]:
    """Return the bounds of the plan's part with an aspect ratio: the route with space around it, in the floor."""
    shown = np.array([task.pair.start[:2], task.pair.goal[:2], *route, *(pair.goal[:2] for pair in task.following)])
    around = AROUND
    if "station" in task.conditions:
        shown, around = shown[[1]], DOCKING / 2.0
    low, high = shown.min(axis=0) - around, shown.max(axis=0) + around
    size = np.maximum(high - low, (high - low)[::-1] * (aspect, 1.0 / aspect))
    middle, bounds = (low + high) / 2.0, np.array(task.layout.floor.bounds)
    floor = bounds[:2] - 0.1, bounds[2:] + 0.1
    # Within the floor where it is large enough, in its middle where it is not.
    inside = np.where(
        size < floor[1] - floor[0],
        np.clip(middle, floor[0] + size / 2.0, np.maximum(floor[1] - size / 2.0, floor[0] + size / 2.0)),
        (floor[0] + floor[1]) / 2.0,
    )
    (x0, y0), (x1, y1) = (inside - size / 2.0).tolist(), (inside + size / 2.0).tolist()
    return x0, y0, x1, y1


def _write_title(picture: Image.Image, world: EpisodeWorld, head: int) -> None:
    draw, episode = ImageDraw.Draw(picture), world.episode
    left, large, small = round(0.2 * head), round(0.36 * head), round(0.22 * head)
    draw.text((left, round(0.1 * head)), world.name, palette.INK, font(large, True))
    after = left + draw.textlength(f"{world.name}  ", font(large, True))
    summary = task_of(world.name).summary
    draw.text((after, round(0.21 * head)), summary, palette.INK, font(round(0.26 * head)))
    length = sum(episode.lengths)
    goals = f", {len(episode.lengths)} goals" if len(episode.lengths) > 1 else ""
    words = f"level {world.level}   {episode.key}   L* {length:.1f} m{goals}"
    draw.text((left, round(0.62 * head)), words, palette.MUTED, font(small))


def _legend(task: Task) -> list[tuple[str, str, str]]:
    """Return mark, color and words of what the plan shows."""
    entries = [("disc", ROBOT_COLOR, "robot"), ("line", ROUTE, "shortest path"), ("disc", GOAL, "goal")]
    if "people" in task.conditions:
        entries += [("disc", PERSON, "yields"), ("disc", UNSEEING, "does not see the robot")]
    after, before = task.layout, task.old_map or task.layout
    panes = any(one.asset in (FRAMED, FRAMELESS) for one in after.placements)
    if panes:
        entries.append(("line", PANE, "glass"))
    if task.pushable:
        entries.append(("box", PUSHED, "can be pushed"))
    if "station" in task.conditions:
        entries += [("box", CHANGED, "where the station is"), ("frame", GONE, "where the map has it")]
    elif before is not after and not panes:
        entries += [("box", CHANGED, "not on the map"), ("frame", GONE, "on the map only")]
    if "parked" in task.conditions and len(neck_of(task)):
        entries.append(("disc", NECK, "neck"))
    return entries


def _write_legend(picture: Image.Image, entries: Sequence[tuple[str, str, str]], top: int, foot: int) -> None:
    """Write a legend in one line, in the largest letters that fit."""
    draw, unit = ImageDraw.Draw(picture), float(foot)
    while unit > 8.0 and _legend_width(draw, entries, unit) > picture.width:
        unit *= 0.97
    x, middle, letters = 0.4 * unit, top + foot / 2.0, font(round(0.46 * unit))
    for mark, color, words in entries:
        half, thick = (0.3 * unit, 0.06 * unit) if mark == "line" else (0.2 * unit, 0.2 * unit)
        box = (x, middle - thick, x + 2.0 * half, middle + thick)
        if mark == "frame":
            draw.rectangle(box, outline=rgb(color), width=max(1, round(0.05 * unit)))
        else:
            (draw.ellipse if mark == "disc" else draw.rectangle)(box, fill=rgb(color))
        x += 2.0 * half + 0.2 * unit
        draw.text((x, middle), words, palette.INK, letters, anchor="lm")
        x += draw.textlength(words, letters) + 0.55 * unit


def _legend_width(draw: ImageDraw.ImageDraw, entries: Sequence[tuple[str, str, str]], unit: float) -> float:
    letters = font(round(0.46 * unit))
    marks = sum(0.6 * unit if mark == "line" else 0.4 * unit for mark, _, _ in entries)
    return marks + sum(draw.textlength(words, letters) + 0.75 * unit for _, _, words in entries) + 0.4 * unit
