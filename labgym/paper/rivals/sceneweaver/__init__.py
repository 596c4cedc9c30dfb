"""SceneWeaver: an initial scene, then a loop of reflecting on it and acting with one tool, with physics after each."""

from labgym.paper.rivals.sceneweaver.proposer import SceneWeaverProposer

__all__ = ["SceneWeaverProposer"]
