"""Scores of layouts: geometry, feasibility, chemical safety, consistency."""
