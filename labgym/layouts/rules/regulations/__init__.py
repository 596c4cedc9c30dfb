"""Regulation profiles: the clauses of US, European and Chinese rules that a layout's geometry decides, one by one."""

from labgym.layouts.rules.regulations.clause import LegalClause, Measured, Ruling
from labgym.layouts.rules.regulations.profiles import REGULATIONS, rulings

__all__ = ["REGULATIONS", "LegalClause", "Measured", "Ruling", "rulings"]
