"""An iPlanner-style policy: a path from one depth image and a goal, by a network trained through a cost map."""
