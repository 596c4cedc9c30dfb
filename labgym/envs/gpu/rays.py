"""Rays of the lidars or cameras of many robots, each cast against the mesh of its scene, for Warp."""

from __future__ import annotations

from labgym.envs.gpu.backend import wp


@wp.kernel(enable_backward=False)
def cast(
    rows: wp.array[wp.int32],
    poses: wp.array2d[wp.float64],
    meshes: wp.array[wp.uint64],
    directions: wp.array[wp.vec3],
    scales: wp.array[wp.float32],
    forward: wp.float64,
    height: wp.float32,
    reach: wp.float32,
    limit: wp.float32,
    readings: wp.array2d[wp.float32],
):
    """Write what each ray of some robots reads, meters.

    Args:
        rows: (m,) the robots. poses: (n, 3). meshes: (n,) identity of the mesh of each robot.
        directions: (k,) unit vectors in the robot frame. scales: (k,) reading per length of the ray.
        forward, height: start point of the rays in the robot's plane of symmetry, meters.
        reach: greatest length of a ray. limit: greatest reading.
        readings: (n, k).
    """
    place, ray = wp.tid()
    robot = rows[place]
    cosine = wp.cos(poses[robot, 2])
    sine = wp.sin(poses[robot, 2])
    start = wp.vec3(
        wp.float32(poses[robot, 0] + forward * cosine), wp.float32(poses[robot, 1] + forward * sine), height
    )
    ahead = wp.float64(directions[ray][0])
    left = wp.float64(directions[ray][1])
    along = wp.vec3(
        wp.float32(cosine * ahead - sine * left), wp.float32(sine * ahead + cosine * left), directions[ray][2]
    )
    hit = wp.mesh_query_ray(meshes[robot], start, along, reach)
    distance = reach
    if hit.result:
        distance = hit.t
    readings[robot, ray] = wp.min(distance * scales[ray], limit)
