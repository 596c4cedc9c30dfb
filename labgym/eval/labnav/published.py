"""A published episode by the name of its suite and its key."""

from __future__ import annotations

from labgym.envs.labnav.episodes import LabNavEpisode, LabNavEpisodes
from labgym.errors import OptionError, UnknownNameError
from labgym.eval.labnav.suites import load_labnav


def published_episode(suite: str, key: str) -> tuple[LabNavEpisodes, LabNavEpisode, float]:
    """Return an episode of a suite with its task's episodes and its time limit, seconds.

    Args:
        suite: such as "labnav-people-2". key: floor/number, or task-level/floor/number.

    Raises:
        UnknownNameError: there is no such suite or episode.
        OptionError: several tasks of the suite have such an episode.
    """
    chosen = load_labnav(suite)
    keys = chosen.by_key
    fitting = [key] if key in keys else [each for each in keys if each.endswith(f"/{key.lstrip('/')}")]
    if not fitting:
        raise UnknownNameError(f"episode of {suite}", key, keys)
    if len(fitting) > 1:
        raise OptionError(f"episode {key!r} of {suite} is one of {', '.join(fitting[:5])}: name its task too")
    return *keys[fitting[0]], chosen.seconds
