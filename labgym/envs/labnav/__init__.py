"""LabNav: the tasks of the benchmark, their levels, and their episodes."""
