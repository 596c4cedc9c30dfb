"""Version 2 of the layout metrics, `touchstone-v2`: what a spoilt layout could pass in version 1 counts here.

Each module has one definition; `assessment` brings them together. docs/metrics.md compares the versions.
"""
