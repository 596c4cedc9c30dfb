"""Places a brief's furniture in a room: a constraint program over centimeters, solved by CP-SAT.

Every wall unit chooses a wall and a position along it; islands choose a position and one of two headings. Footprints
do not overlap, the zone in front of each unit is free of footprints, door areas stay clear, hazards keep their
distance, and fixed objects are obstacles. Deterministic: one worker, a fixed seed and a deterministic time limit.
"""

from labgym.layouts.floor_plan.program import GROUPS
from labgym.layouts.floor_plan.solution import Pose, Solution, solve

__all__ = ["GROUPS", "Pose", "Solution", "solve"]
