"""The planar kernel: the robot, its contacts and its lidar in the plane, compiled by numba (extra `fast`).

It reproduces MuJoCo's physics of this robot, whose base moves in the plane: the same servos, integration step and soft
contacts. `labgym.envs.simulation` stays the reference and gives every published score. docs/performance.md states how
far the two agree.
"""
