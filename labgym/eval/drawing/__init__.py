"""Plans, routes, rendered views and films."""
