"""The source of the tasks of a configuration."""

from __future__ import annotations

from labgym.envs.config import LABNAV, PointNavConfig
from labgym.envs.labnav.source import LabNavTasks
from labgym.envs.parts.protocols import Tasks
from labgym.envs.protocol_tasks import ProtocolTasks
from labgym.envs.tasks import TaskSource


def task_source(config: PointNavConfig) -> Tasks:
    """Return what chooses the task of each episode.

    Raises:
        UnknownNameError, OptionError, DocumentError: as `TaskSource`.
    """
    if config.tasks is not None:
        return config.tasks
    source = TaskSource(
        config.split,
        config.layout,
        config.protocol,
        training=config.training,
        resident_mb=config.resident_mb,
        profile=config.profile,
        episodes_per_layout=config.episodes_per_layout,
        pool=config.pool,
        senses=config.senses,
    )
    if config.drives.startswith(LABNAV):
        return LabNavTasks(source, config.drives)
    return source if config.drives == "pair" else ProtocolTasks(source)
