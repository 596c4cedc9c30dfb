"""What exists only to reproduce the paper LabBuilder: its rivals, damage, studies, tables and files."""
