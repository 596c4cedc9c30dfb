"""Occupancy, grid search, exact shortest paths, and the goal poses and goal pairs of a protocol."""

from labgym.navigation.drives import RouteMeasures, TriedPair, draw_drives, route_measures
from labgym.navigation.feasibility import METHODS, Method, Transition, feasibility, transitions
from labgym.navigation.gaps import Gaps
from labgym.navigation.goals import GoalPair, Pose, goal_pairs, goal_pose, goal_poses, resolve_protocol
from labgym.navigation.grid_search import astar, distance_field
from labgym.navigation.lengths import LengthsTo
from labgym.navigation.occupancy import RESOLUTION, OccupancyGrid, occupancy
from labgym.navigation.plan import OBSTACLE_HEIGHT, PLANNING_RADIUS, STAND_OFF, FloorPlan
from labgym.navigation.visibility import ShortestPath, ShortestPaths, shortest_path

__all__ = [
    "METHODS",
    "OBSTACLE_HEIGHT",
    "PLANNING_RADIUS",
    "RESOLUTION",
    "STAND_OFF",
    "FloorPlan",
    "Gaps",
    "GoalPair",
    "LengthsTo",
    "Method",
    "OccupancyGrid",
    "Pose",
    "RouteMeasures",
    "ShortestPath",
    "ShortestPaths",
    "Transition",
    "TriedPair",
    "astar",
    "distance_field",
    "draw_drives",
    "feasibility",
    "goal_pairs",
    "goal_pose",
    "goal_poses",
    "occupancy",
    "resolve_protocol",
    "route_measures",
    "shortest_path",
    "transitions",
]
