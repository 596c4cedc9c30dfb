"""The published results: tables, and rows that a run is checked against."""
