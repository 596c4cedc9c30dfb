"""Studies that measure what the tables of the paper measure; each writes a page with both."""
