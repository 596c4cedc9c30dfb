"""The Policy interface, the path tracker, and all policies by name."""

from labgym.policies.policy import EpisodeStart, GroundTruth, Observation, Policy
from labgym.policies.registry import make_policy, policy_names
from labgym.policies.tracking import PathTracker, TrackingOptions, velocities_to_action

__all__ = [
    "EpisodeStart",
    "GroundTruth",
    "Observation",
    "PathTracker",
    "Policy",
    "TrackingOptions",
    "make_policy",
    "policy_names",
    "velocities_to_action",
]
