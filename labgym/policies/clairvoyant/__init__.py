"""Motion of a robot that knows the true layout and where people will be: path, schedule, tracking."""

from labgym.policies.clairvoyant.foreknowledge import Foreknowledge
from labgym.policies.clairvoyant.motion import Motion

__all__ = ["Foreknowledge", "Motion"]
