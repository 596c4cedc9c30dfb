"""A second judge of layouts: polygons (shapely) read from the written file, without the code of the rules."""

from labgym.eval.outside.checks import findings
from labgym.eval.outside.written_plan import WrittenPlan

__all__ = ["WrittenPlan", "findings"]
