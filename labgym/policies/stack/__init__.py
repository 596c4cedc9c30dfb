"""A navigation stack on an old map: localization, costmap, planner, sampling controller, docking, people, recovery."""
