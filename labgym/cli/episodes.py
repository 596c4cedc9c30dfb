"""`labgym view --task`: the world of a LabNav episode as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from labgym.cli.outcome import written

if TYPE_CHECKING:
    from labgym.envs.labnav.episodes import LabNavEpisode
    from labgym.layouts import Layout

SIZE = (900, 560)
"""Size of the rendered view, pixels."""


def view_episode(
    task: str, level: int, episode: str | None, seed: int, out: Path | None, size: tuple[int | None, int | None]
) -> int:
    """Write the picture of an episode; the arguments are those of `labgym view`."""
    from labgym.eval.drawing.episode_picture import (
        EpisodeWorld,
        check_episode_size,
        check_picture_path,
        episode_picture,
        save_episode_picture,
    )

    out = Path(f"{task}-{level}.png") if out is None else out
    width, height = (SIZE[k] if size[k] is None else size[k] for k in (0, 1))
    assert width is not None
    assert height is not None
    check_picture_path(out)
    check_episode_size(width, height)
    layout, chosen = _episode(task, level, episode, seed)
    world = EpisodeWorld.of(task, level, chosen, layout)
    return written(save_episode_picture(episode_picture(world, width, height), out))


def _episode(task: str, level: int, episode: str | None, seed: int) -> tuple[Layout, LabNavEpisode]:
    """Return a published episode, or one that is drawn, and its floor."""
    from labgym.envs.labnav.tasks import task_of
    from labgym.envs.labnav.worlds import drawn_episode
    from labgym.eval.labnav.published import published_episode

    task_of(task).level(level)
    if episode is None:
        return drawn_episode(task, level, seed)
    part, chosen, _ = published_episode(f"labnav-{task}-{level}", episode)
    return part.layout(chosen.floor), chosen
