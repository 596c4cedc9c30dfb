"""European clauses: EN standards, EU directives, and German rules where the figure is left to the member states."""

from __future__ import annotations

from labgym.layouts.rules.regulations import measures
from labgym.layouts.rules.regulations.clause import LegalClause

CLAUSES = (
    LegalClause(
        "Directive 89/654/EEC, annex I, 4.5", "objects in the area inside a door", "at most", 0.0,
        measures.objects_at_doors, "recalled",
    ),
    LegalClause(
        "DGUV Information 213-850 (TRGS 526), 6.2.2", "exits of each laboratory (recommended)", "at least", 2.0,
        measures.doors_of_rooms(0.0), "read",
    ),
    LegalClause(
        "DGUV Information 213-850 (TRGS 526), 6.2.2", "walk to an exit", "at most", 25.0, measures.walks_out, "read"
    ),
    LegalClause(
        "DGUV Information 213-850 (TRGS 526), 6.2.1", "width of ways", "at least", 0.90, measures.ways_out(0.90), "read"
    ),
    LegalClause(
        "ASR A2.3 (2022), 5", "clear width of doors in ways out",
        "at least", 0.90, measures.door_widths, "recalled",
    ),
    LegalClause(
        "EN 14056", "free depth before one person's bench or hood", "at least", 1.00, measures.free_before_benches(1.0),
        "read",
    ),
    LegalClause(
        "EN 14056", "distance between work rows back to back", "at least", 1.45, measures.between_work_rows, "read"
    ),
    LegalClause(
        "ASR A1.2, 6", "ceiling of a room up to 50 m²", "at least", 2.50, measures.ceilings(0.0, 50.0), "recalled"
    ),
    LegalClause(
        "ASR A1.2, 6", "ceiling of a room of 50 to 100 m²",
        "at least", 2.75, measures.ceilings(50.0, 100.0), "recalled",
    ),
    LegalClause("ASR A1.2, 6", "ceiling of a room over 100 m²", "at least", 3.00, measures.ceilings(100.0), "recalled"),
    LegalClause(
        "CEN/TS 14175-5 (BS 7258-2)", "distance of a hood from a door", "at least", 1.00, measures.hood_to_door,
        "recalled",
    ),
    LegalClause(
        "CEN/TS 14175-5 (BS 7258-2)", "distance of a hood from a bench opposite", "at least", 1.40,
        measures.hood_to_opposite("bench"), "recalled",
    ),
    LegalClause(
        "CEN/TS 14175-5 (BS 7258-2)", "distance of a hood from a wall or tall furniture opposite", "at least", 2.00,
        measures.hood_to_opposite("wall"), "recalled",
    ),
    LegalClause(
        "CEN/TS 14175-5 (BS 7258-2)", "distance of two hoods face to face", "at least", 3.00,
        measures.hood_to_opposite("hood"), "recalled",
    ),
    LegalClause(
        "CEN/TS 14175-5 (BS 7258-2)", "distance of a hood's side from a side wall", "at least", 0.30,
        measures.hood_to_side_wall, "recalled",
    ),
    LegalClause(
        "EN 15154-1", "clear radius about a shower: 95% of its water falls within 0.40 m", "at least", 0.40,
        measures.shower_radius, "read",
    ),
    LegalClause(
        "TRGS 510, 7.2", "pairs of incompatible reagents that share a cabinet or stand outside of cabinets", "at most",
        0.0, measures.incompatible_pairs_together, "recalled",
    ),
    LegalClause(
        "EN 14470-1; TRGS 510, annex 1", "flammable liquids outside of safety cabinets", "at most", 0.0,
        measures.flammables_outside, "recalled",
    ),
)  # fmt: skip
