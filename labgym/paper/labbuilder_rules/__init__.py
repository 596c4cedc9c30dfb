"""The rule set `labbuilder`: what the evaluator that LabBuilder's authors released computes, literal and corrected."""
