"""Datasets of expert drives for other training libraries: Parquet, Minari and LeRobot."""

from labgym.datasets.make import make_drives
from labgym.datasets.options import DriveOptions, drive_options

__all__ = ["DriveOptions", "drive_options", "make_drives"]
