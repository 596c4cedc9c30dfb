"""labgym: chemistry laboratories generated from protocols, and a benchmark of robot navigation in them."""

from gymnasium import register

__version__ = "0.1.0"

_VECTOR = "labgym.envs.vector:vector_env"

register(
    id="LabPointNav-v0",
    entry_point="labgym.envs.point_nav:LabPointNavEnv",
    vector_entry_point=_VECTOR,
    max_episode_steps=600,
)

for _name, _steps in (
    ("LabFloorNav-v0", 1500),
    ("LabFloorNavDepth-v0", 1500),
    ("LabFloorNavRGBD-v0", 1500),
    ("LabFloorNavDiscrete-v0", 500),
    ("LabFloorNavGoal-v0", 1500),
    ("LabProtocolNav-v0", 6000),
    ("LabNavAisle-v0", 1200),
    ("LabNavMoved-v0", 1200),
    ("LabNavPeople-v0", 1200),
    ("LabNavDock-v0", 1200),
    ("LabNavOdometry-v0", 1200),
    ("LabNavGlass-v0", 1200),
    ("LabNavCarry-v0", 1200),
    ("LabNavShift-v0", 12000),
):
    _goals = _name == "LabFloorNavGoal-v0"
    register(
        id=_name,
        entry_point="labgym.envs." + ("goal_env:LabFloorNavGoalEnv" if _goals else "point_nav:LabPointNavEnv"),
        vector_entry_point=_VECTOR,
        max_episode_steps=_steps,
        kwargs={"config": _name},
    )

register(
    id="LabNavMovedFixed-v0",
    entry_point="labgym.envs.point_nav:LabPointNavEnv",
    vector_entry_point=_VECTOR,
    max_episode_steps=1200,
    kwargs={
        "config": "LabNavMoved-v0",
        "conditions": ("contacts", {"kind": "changes", "spacing": 3.0, "pushable": False}),
    },
)
