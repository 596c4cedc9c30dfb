"""Wrappers of the point navigation environments, by the conventions of Gymnasium."""

from labgym.envs.wrappers.action_repeat import ActionRepeat
from labgym.envs.wrappers.egocentric_map import EgocentricMap
from labgym.envs.wrappers.map_inset import MapInset
from labgym.envs.wrappers.odometry_noise import OdometryNoise

__all__ = ["ActionRepeat", "EgocentricMap", "MapInset", "OdometryNoise"]
