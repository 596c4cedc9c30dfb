"""An iPlanner-style policy: a path from one depth image and a goal, learned without labels from cost maps."""
