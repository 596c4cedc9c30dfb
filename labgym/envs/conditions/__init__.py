"""Conditions of an episode beyond its layout: people, things that moved, glass, a payload, docking stations."""
