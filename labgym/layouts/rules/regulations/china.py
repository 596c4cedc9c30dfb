"""Chinese clauses: JGJ 91-2019 (design standard for science research buildings), GB 50016-2014, and practice."""

from __future__ import annotations

from labgym.layouts.rules.regulations import measures
from labgym.layouts.rules.regulations.clause import LegalClause

CLAUSES = (
    LegalClause(
        "GB 50016-2014, 5.5.15", "doors of a room over 120 m²", "at least", 2.0, measures.doors_of_rooms(120.0), "read"
    ),
    LegalClause("GB 50016-2014, 5.5.18", "clear width of doors", "at least", 0.90, measures.door_widths, "recalled"),
    LegalClause(
        "JGJ 91-2019 (half a module)", "clear width of a laboratory's doors", "at least", 1.20, measures.door_widths,
        "read",
    ),
    LegalClause(
        "JGJ 91-2019", "width of a corridor with rooms on one side",
        "at least", 1.50, measures.corridor_widths, "read",
    ),
    LegalClause(
        "JGJ 91-2019", "ceiling of an air-conditioned laboratory", "at least", 2.60, measures.ceilings(), "read"
    ),
    LegalClause(
        "GB 50016-2014, 5.5.17", "walk to a door of the room, at its farthest place", "at most", 22.0,
        measures.walks_out, "recalled",
    ),
    LegalClause(
        "JGJ 91-2019, 5.3.3 (mandatory)", "way from corrosives to an emergency eyewash", "at most", 15.0,
        measures.walks_to("eyewash", "corrosive"), "read",
    ),
    LegalClause(
        "JGJ 91-2019, 5.3.3 (mandatory)", "way from corrosives to an emergency shower", "at most", 15.0,
        measures.walks_to("shower", "corrosive"), "read",
    ),
    LegalClause(
        "practice (fnlaboratory.com guide)", "distance between work rows back to back", "at least", 1.30,
        measures.between_work_rows, "read",
    ),
    LegalClause(
        "practice (fnlaboratory.com guide)", "distance of a hood from a bench opposite", "at least", 1.25,
        measures.hood_to_opposite("bench"), "read",
    ),
    LegalClause(
        "GB 15603-2022, 4", "pairs of incompatible reagents that share a cabinet or stand outside of cabinets",
        "at most", 0.0, measures.incompatible_pairs_together, "recalled",
    ),
    LegalClause(
        "GB 50140-2005, 5.2.2 (severe hazard, class B)", "walk from flammables to a fire extinguisher", "at most", 9.0,
        measures.walks_to("extinguisher", "flammable"), "recalled",
    ),
)  # fmt: skip
