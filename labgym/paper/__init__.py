"""Reproduction of the paper LabBuilder: its rivals, damage, studies, tables and files. Only the commands import it."""
