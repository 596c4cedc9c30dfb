"""Films of drives: the robot from behind and above, with its own camera's view in the corner."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from labgym.envs.conditions.bodies import Body, BodyRays
from labgym.envs.sensors import Camera
from labgym.envs.view import ChaseView
from labgym.errors import LabgymError, OptionError
from labgym.eval.driving.drive import Route
from labgym.layouts import Layout
from labgym.scenes import Quality, RayScene
from labgym.temporary import temporary_folder

Picture = NDArray[np.uint8]

INSET = 0.28
"""Width of the robot's own view relative to the picture's."""

BORDER = 3
COLORS = 128
"""Colors of each picture of a GIF."""

WEBP_QUALITY = 45
"""Quality of an animated WebP, of 100."""

NO_PICTURE = "a film needs at least one picture, and the drive has none"


def film(
    layout: Layout,
    route: Route,
    width: int = 480,
    height: int = 360,
    quality: Quality = "fast",
    bodies: Sequence[Sequence[Body]] = (),
) -> Iterator[Picture]:
    """Yield a picture (height, width, 3) for each pose of a route.

    Args:
        bodies: what conditions add at each pose, such as people (`Presence.bodies`); nothing beyond its end.
        quality: "fast", or "fine" with shadows and reflections, which takes about ten times as long without a GPU.

    Raises:
        OptionError: the picture is larger than the scene's off-screen buffer, or too small.
        MissingRendererError: OpenGL is not available.
    """
    if min(width, height) < 96:
        raise OptionError(f"film size {width}x{height} is too small; the minimum is 96x96")
    rays, camera, view = RayScene(layout, "visual"), Camera(), ChaseView(width, height, quality)
    try:
        for number, pose in enumerate(route):
            present = bodies[number] if number < len(bodies) else ()
            picture = view.picture(layout, rays, pose, bodies=present)
            color, _ = camera.colour_and_depth(BodyRays(rays, len(rays.mesh.faces), present), pose)
            yield _with_inset(picture, color)
    finally:
        view.close()


def check_film_path(path: Path) -> None:
    """Raise OptionError if a film path does not end in .mp4, .gif or .webp."""
    if path.suffix not in WRITERS:
        raise OptionError(f"film {path.name!r} must end in .mp4, .gif or .webp")


def save_film(pictures: Iterable[Picture], path: str | Path, rate: float = 10.0) -> Path:
    """Write pictures of one size as .mp4, .gif or .webp, by the path's suffix. A failure leaves no file behind.

    Args:
        rate: pictures per second.

    Raises:
        OptionError: the path has another suffix.
        LabgymError: there are no pictures, or this build of OpenCV cannot write MP4.
    """
    path = Path(path)
    check_film_path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with temporary_folder(path.parent) as temporary:
        unfinished = temporary / f"film{path.suffix}"
        WRITERS[path.suffix](iter(pictures), unfinished, rate)
        unfinished.replace(path)
    return path


def _with_inset(picture: Picture, color: Picture) -> Picture:
    """Return a picture with another one in its lower right corner."""
    width = int(picture.shape[1] * INSET)
    small = cv2.resize(color, (width, width * color.shape[0] // color.shape[1]), interpolation=cv2.INTER_LINEAR)
    framed = cv2.copyMakeBorder(small, *(BORDER,) * 4, cv2.BORDER_CONSTANT, value=(255, 255, 255))
    rows, columns = framed.shape[:2]
    whole = picture.copy()
    whole[-rows - 8 : -8, -columns - 8 : -8] = framed
    return whole


def _write_mp4(pictures: Iterator[Picture], path: Path, rate: float) -> None:
    first = next(pictures, None)
    if first is None:
        raise LabgymError(NO_PICTURE)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), rate, (first.shape[1], first.shape[0]))
    try:
        if not writer.isOpened():
            raise LabgymError("this build of OpenCV cannot write MP4; write a .gif instead")
        writer.write(first[..., ::-1])
        for picture in pictures:
            writer.write(picture[..., ::-1])
    finally:
        writer.release()


def _write_gif(pictures: Iterator[Picture], path: Path, rate: float) -> None:
    frames = [Image.fromarray(picture).quantize(COLORS, dither=Image.Dither.NONE) for picture in pictures]
    if not frames:
        raise LabgymError(NO_PICTURE)
    first, *others = frames
    duration = round(1000.0 / rate)
    first.save(path, format="GIF", save_all=True, append_images=others, duration=duration, loop=0, optimize=True)


def _write_webp(pictures: Iterator[Picture], path: Path, rate: float) -> None:
    first = next(pictures, None)
    if first is None:
        raise LabgymError(NO_PICTURE)
    Image.fromarray(first).save(
        path,
        format="WEBP",
        save_all=True,
        append_images=map(Image.fromarray, pictures),
        duration=round(1000.0 / rate),
        loop=0,
        quality=WEBP_QUALITY,
        method=4,
        minimize_size=True,
    )


WRITERS: Mapping[str, Callable[[Iterator[Picture], Path, float], None]] = {
    ".mp4": _write_mp4,
    ".gif": _write_gif,
    ".webp": _write_webp,
}
"""Functions that write films, by suffix."""
