"""A record of OpenExp that several test files share."""

from __future__ import annotations

from typing import Any

RECORD: dict[str, Any] = {
    "index": 17,
    "REACTANT": ["O=Cc1ccccc1", "Nc1ccccc1"],
    "PRODUCT": ["C(=Nc1ccccc1)c1ccccc1"],
    "CATALYST": ["CC(=O)O"],
    "SOLVENT": ["CCO"],
    "actions": "MAKESOLUTION with $1$ (5.3 g, 50 mmol) and $3$ (10 mL) ; ADD SLN ; ADD $2$ (4.7 g) dropwise at #4# "
    "under N2 over @5@ ; STIR for @6@ at #7# ; FILTER keep precipitate ; WASH with cold ethanol (5 mL) 2 x ; "
    "YIELD $-1$ (8 g, 88%).",
    "source": "An imine.",
    "extracted_molecules": {
        "O=Cc1ccccc1": "$1$",
        "Nc1ccccc1": "$2$",
        "CCO": "$3$",
        "C(=Nc1ccccc1)c1ccccc1": "$-1$",
    },
    "extracted_temperature": {"0-5 °C": "#4#", "room temperature": "#7#"},
    "extracted_duration": {"10 minutes": "@5@", "overnight": "@6@"},
    "molecules": {"benzaldehyde": "O=Cc1ccccc1", "aniline": "Nc1ccccc1", "EtOH": "CCO", "brine": None},
    "score": 0.4,
}
