"""`labgym run`: the whole pipeline, stage by stage; what has not changed is not done again."""

from labgym.pipeline.config import RunConfig

__all__ = ["RunConfig"]
