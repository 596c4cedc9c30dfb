"""Solvents of spectra are no reagents of the procedure; deuterated solvents of reactions are."""

from __future__ import annotations

import pytest

from labgym.assets import Catalog
from labgym.protocols.synthesis import read

CATALOG = Catalog.load()
PROCEDURE = "Reduce benzophenone (5 g) with sodium borohydride (1 g) in methanol (40 mL) at 0 C for 1 h. "
REAGENTS = ("Benzophenone", "SodiumBorohydride", "Methanol")


@pytest.mark.parametrize(
    "spectrum",
    [
        "1H NMR (400 MHz, D2O) d 7.3 (m, 5H).",
        "The product was a white solid. 1H NMR (CDCl3, 300 MHz): 7.26 (m, 5H), 4.7 (s, 2H).",
        "13C NMR (101 MHz, DMSO-d6) 170.1.",
        "1H NMR (400 MHz, Methanol-d4) 7.1 (s, 1H).",
        "1H-NMR (500 MHz, acetone-d6): 2.1 (s, 3H).",
        "31P NMR (162 MHz, THF-d8) 29.",
        "1H NMR (400 MHz, DMSO) 8.1 (s, 1H).",
        "Check by NMR in CDCl3.",
        "Record the NMR spectrum in deuterated chloroform.",
        "The NMR (in CDCl3 with TMS) agrees.",
        "1H NMR (CDCl3/TMS) 7.2 (m).",
        "LCMS (ESI, acetonitrile/water) m/z 212.",
        "IR (CHCl3) 1700; [α]D (c 1.0, CHCl3) +23; Rf 0.4 (ethyl acetate/hexane 1:4).",
        "核磁（400 MHz，D2O）显示产物。",
    ],
)
def test_the_solvent_of_a_spectrum_is_no_reagent(spectrum: str) -> None:
    reading = read(PROCEDURE + spectrum, CATALOG)
    assert reading.reagents == REAGENTS
    assert reading.unlisted == ()


@pytest.mark.parametrize("step", ["Stir the ketone in D2O at 22 C for 24 h.", "Quench with D2O (5 mL)."])
def test_a_deuterated_solvent_of_a_reaction_is_a_substance(step: str) -> None:
    assert read(PROCEDURE + step, CATALOG).unlisted == ("D2O",)
