"""Checks of results that others submit: files, episodes, routes, and a random tenth driven again."""
