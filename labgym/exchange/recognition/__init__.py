"""Proposals of floors from maps and drawings that the strict readers refuse."""
