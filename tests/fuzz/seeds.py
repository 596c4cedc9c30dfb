"""The published documents that mutations begin with; the process that forks for every loader reads them once."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("assets", "layouts", "policies", "eval")


def _smallest() -> dict[str, list[Any]]:
    """Return up to three of the smallest published documents of each schema."""
    found: dict[str, list[tuple[int, str, Any]]] = {}
    for path in (path for folder in FOLDERS for path in (ROOT / folder).rglob("*.json")):
        data = json.loads(path.read_bytes())
        if isinstance(data, dict) and "schema" in data:
            rows = found.setdefault(data["schema"], [])
            rows.append((path.stat().st_size, str(path), data))
            rows.sort(key=lambda row: row[:2])
            del rows[3:]
    return {schema: [data for _, _, data in rows] for schema, rows in found.items()}


SEEDS = _smallest()
