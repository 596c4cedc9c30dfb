"""LabBuilder's scene files: laboratories in the JSON form of the paper's authors, read and written."""
