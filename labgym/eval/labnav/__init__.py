"""LabNav: driving its episodes, their scores, and the figure."""
