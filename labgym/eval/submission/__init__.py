"""Checks of results that others submit: files, episodes and routes, and episodes driven again."""
