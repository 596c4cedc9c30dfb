"""Scores of a layout: geometry, feasibility, chemical safety, consistency."""
