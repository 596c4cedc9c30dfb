"""Watch policies drive, or drive by keyboard, in a web browser of this machine."""

from labgym.viewer.console import Command, Console
from labgym.viewer.episodes import Episode, episodes_of
from labgym.viewer.labnav import LabNavShow, LabNavWatch
from labgym.viewer.person import LabNavPerson, Person
from labgym.viewer.server import ViewerServer
from labgym.viewer.session import run_viewer
from labgym.viewer.show import Show

__all__ = [
    "Command",
    "Console",
    "Episode",
    "LabNavPerson",
    "LabNavShow",
    "LabNavWatch",
    "Person",
    "Show",
    "ViewerServer",
    "episodes_of",
    "run_viewer",
]
