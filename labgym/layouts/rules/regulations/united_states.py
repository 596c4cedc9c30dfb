"""Clauses of the United States: OSHA, ADA, NFPA, IFC, ANSI, and the California Building Code (24 CCR)."""

from __future__ import annotations

from labgym.layouts.floor.fields import CALIFORNIA, NFPA_45
from labgym.layouts.rules.regulations import measures
from labgym.layouts.rules.regulations.clause import LegalClause

CLAUSES = (
    LegalClause(
        "OSHA 29 CFR 1910.36(b)", "exits of each laboratory", "at least", 1.0, measures.doors_of_rooms(0.0), "read"
    ),
    LegalClause(
        "NFPA 45, 5.4.1 (class B)", "exits of a laboratory over 46.5 m² (500 ft²)", "at least", 2.0,
        measures.doors_of_rooms(NFPA_45), "recalled",
    ),
    LegalClause(
        "24 CCR (as the UC laboratory design manual cites it)", "exits of a laboratory over 18.6 m² (200 ft²)",
        "at least", 2.0, measures.doors_of_rooms(CALIFORNIA), "read",
    ),
    LegalClause(
        "OSHA 29 CFR 1910.36(g)(2)", "width of ways out, 28 in", "at least", 0.711, measures.ways_out(0.711), "read"
    ),
    LegalClause(
        "ADA 2010, 403.5.1", "width of accessible routes, 36 in",
        "at least", 0.915, measures.ways_out(0.915), "recalled",
    ),
    LegalClause("ADA 2010, 404.2.3", "clear width of doors, 32 in", "at least", 0.815, measures.door_widths, "read"),
    LegalClause(
        "24 CCR (as the UC laboratory design manual cites it)", "clear width of exit doors, 36 in", "at least", 0.914,
        measures.door_widths, "read",
    ),
    LegalClause(
        "OSHA 29 CFR 1910.37(a)(3)", "objects in the area inside a door",
        "at most", 0.0, measures.objects_at_doors, "read",
    ),
    LegalClause(
        "OSHA 29 CFR 1910.36(g)(1)", "ceiling of an exit route, 7 ft 6 in",
        "at least", 2.286, measures.ceilings(), "read",
    ),
    LegalClause(
        "24 CCR (as the UC laboratory design manual cites it)", "walk to an exit, 75 ft", "at most", 22.9,
        measures.walks_out, "read",
    ),
    LegalClause(
        "NFPA 45, 6-9.2; ANSI/AIHA Z9.5, 5.4", "distance of a hood from a door, 10 ft", "at least", 3.05,
        measures.hood_to_door, "read",
    ),
    LegalClause(
        "NFPA 45, 6-9.3", "distance of a desk opposite a hood, 10 ft", "at least", 3.05,
        measures.hood_to_opposite("desk"), "read",
    ),
    LegalClause(
        "ANSI/ISEA Z358.1-2014", "walk from a hood or corrosives to a shower, 10 s or 55 ft", "at most", 16.8,
        measures.walks_to("shower", "hood"), "read",
    ),
    LegalClause(
        "OSHA 29 CFR 1910.151(c); ANSI/ISEA Z358.1-2014", "walk from a hood or corrosives to an eyewash, 10 s or 55 ft",
        "at most", 16.8, measures.walks_to("eyewash", "hood"), "read",
    ),
    LegalClause(
        "ANSI/ISEA Z358.1-2014, 4.1.4", "clear radius about a shower, 16 in", "at least", 0.406, measures.shower_radius,
        "recalled",
    ),
    LegalClause(
        "OSHA 29 CFR 1910.157(d)(4)", "walk from flammables to a fire extinguisher, 50 ft", "at most", 15.2,
        measures.walks_to("extinguisher", "flammable"), "read",
    ),
    LegalClause(
        "IFC 5003.9.8", "distance of incompatible reagents that are not in two cabinets, 20 ft", "at least", 6.1,
        measures.incompatibles_outside_cabinets, "recalled",
    ),
    LegalClause(
        "OSHA 29 CFR 1910.106(d)(3)", "flammable liquids outside of cabinets for them", "at most", 0.0,
        measures.flammables_outside, "recalled",
    ),
    LegalClause(
        "UC laboratory design manual (ADA, NFPA 45)", "distance between work rows back to back, 5 ft", "at least", 1.52,
        measures.between_work_rows, "read",
    ),
)  # fmt: skip
"""OSHA 1910.106(d)(3) regulates what counts as a cabinet, and (e)(2) permits up to 95 L outside; amounts are not in a
layout, so the clause takes the stricter practice. Widths over 1.2 m are reported as 1.2 m."""
