"""A learned local planner: a network drives along the path of the navigation stack, in place of its controller."""
