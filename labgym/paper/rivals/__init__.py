"""The generators that LabBuilder is compared with, re-implemented from their publications.

`HolodeckProposer` and `SceneWeaverProposer` read a description of the experiment, `HolodeckPlusProposer` the protocol.
None of them knows chemistry or plans ways.
"""

from labgym.paper.rivals.holodeck import HolodeckPlusProposer, HolodeckProposer
from labgym.paper.rivals.sceneweaver import SceneWeaverProposer

__all__ = ["HolodeckPlusProposer", "HolodeckProposer", "SceneWeaverProposer"]
