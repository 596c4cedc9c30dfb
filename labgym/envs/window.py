"""A window that shows the pictures of an environment, for render_mode="human"."""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.errors import LabgymError, optional_package

TITLE = "labgym"
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER", "SDL_VIDEO_DRIVER")
"""Variables of which one is set where a display is, on Linux."""


class MissingDisplayError(LabgymError):
    """No window can be opened on this machine."""

    def __init__(self, reason: object) -> None:
        super().__init__(
            f"render_mode='human' needs a display ({reason}): use render_mode='rgb_array', or labgym view --web"
        )


class PictureWindow:
    """A window of pygame, opened with the first picture.

    Args:
        rate: largest number of pictures per second; `show` waits.

    Raises:
        MissingDependencyError: pygame is not installed (extra `train`).
        MissingDisplayError: there is no display.
    """

    def __init__(self, rate: float) -> None:
        if sys.platform == "linux" and not any(os.environ.get(name) for name in DISPLAYS):
            raise MissingDisplayError("DISPLAY and WAYLAND_DISPLAY are not set")
        _pygame()
        self._rate = rate
        self._screen: Any = None
        self._clock: Any = None

    def show(self, picture: NDArray[np.uint8]) -> None:
        """Show a picture (height, width, 3), and wait until its turn.

        Raises:
            MissingDisplayError: the display cannot be opened.
        """
        pygame = _pygame()
        height, width = picture.shape[:2]
        if self._screen is None:
            try:
                pygame.display.init()
                self._screen = pygame.display.set_mode((width, height))
            except pygame.error as error:
                raise MissingDisplayError(error) from None
            pygame.display.set_caption(TITLE)
            self._clock = pygame.time.Clock()
        pygame.event.pump()  # Else the system takes the window for hung.
        self._screen.blit(pygame.surfarray.make_surface(picture.swapaxes(0, 1)), (0, 0))
        pygame.display.flip()
        self._clock.tick(self._rate)

    def close(self) -> None:
        """Close the window; the next picture opens it again."""
        if self._screen is not None:
            _pygame().display.quit()
        self._screen = self._clock = None

    def __getstate__(self) -> dict[str, Any]:
        # A window stays in its process; a copy opens its own.
        return {**self.__dict__, "_screen": None, "_clock": None}


def _pygame() -> Any:
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    with optional_package("pygame", "render_mode='human'", "train"):
        import pygame
    return pygame
