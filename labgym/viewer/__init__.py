"""Watch policies drive, or drive by keyboard, in a web browser of this machine."""

from labgym.viewer.console import Command, Console, KeyboardDriver, LabNavKeyboardDriver
from labgym.viewer.episodes import ViewerEpisode, episodes_of
from labgym.viewer.labnav import LabNavShow, LabNavWatch
from labgym.viewer.server import ViewerServer, run_viewer
from labgym.viewer.show import Show

__all__ = [
    "Command",
    "Console",
    "KeyboardDriver",
    "LabNavKeyboardDriver",
    "LabNavShow",
    "LabNavWatch",
    "Show",
    "ViewerEpisode",
    "ViewerServer",
    "episodes_of",
    "run_viewer",
]
