"""`labgym run`: the whole pipeline, stage by stage; unchanged work is skipped."""

from labgym.pipeline.config import RunConfig

__all__ = ["RunConfig"]
