"""Layouts as OpenUSD stages with physics, lights, cameras and semantic labels."""

from labgym.scenes.usd.stage import write_usd

__all__ = ["write_usd"]
