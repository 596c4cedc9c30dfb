"""Many robots on a GPU: motion, contacts, lidar and depth by Warp kernels (extra `warp`).

The kernels repeat `labgym.envs.planar` in double precision and cast rays against the meshes that Embree casts against.
They also run on Warp's CPU backend, where they are tested. docs/performance.md says how far they agree.
"""
