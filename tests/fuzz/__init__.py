"""Damaged and hostile files for every loader."""
