"""Navigation evaluation: suites, episodes, metrics and statistics."""
