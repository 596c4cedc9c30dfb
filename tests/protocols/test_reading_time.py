"""Descriptions of the greatest length are read quickly, whatever they contain."""

from __future__ import annotations

import contextlib
import time

import pytest

from labgym.assets import Catalog
from labgym.errors import LabgymError
from labgym.protocols import RefusalError
from labgym.protocols.synthesis import read, synthesize
from labgym.protocols.synthesis.synthesis import MAX_TEXT

CATALOG = Catalog.load()
LIMIT_S = 5.0
"""Bound on the CPU time of one reading; typical is a tenth of a second, exponential patterns took hours."""
REALISTIC = (
    "To a solution of cyclohexanol (1.0 g, 10 mmol) in DCM (20 mL) at 0 C was added PCC (2.6 g, 12 mmol) in portions. "
    "After 30 min the mixture was warmed to room temperature and stirred for 20 h, then filtered through Celite, "
    "washed with 2 N NaOH (3 x 20 mL) and brine, dried over MgSO4 and concentrated under reduced pressure. "
)
TEXTS = {
    "realistic": REALISTIC,
    "Chinese": "将苯酚（5 g）溶于丙酮（50 mL），50℃下加入碳酸钾，回流5小时，过滤，浓缩，用乙醇重结晶。",
    "letters after an amount": "Add 5 g abcdefghijklmnopqrstuvwxyzabcdefghijkl",
    "words after an amount": "5 g cold dry hot warm pure solid crude ",
    "radicals": "methyl-ethyl-propyl-",
    "spaces": "Add 5 g   ",
    "ratios": "ethanol/water (1:1:1:1:1 ",
    "opening brackets": "phenol (",
    "numbers": "1 ",
    "amounts": "1 g 2 mL ",
    "reagents": "phenol, acetone, ",
    "periods": "give a ",
    "commas": "the ,",
    "formulas": "C6H5(CH2)",
}


@pytest.mark.cases(7)
@pytest.mark.parametrize("part", TEXTS.values(), ids=TEXTS)
def test_a_text_of_the_greatest_length_is_read_quickly(part: str) -> None:
    text = (part * MAX_TEXT)[:MAX_TEXT]
    read("Reduce benzophenone with NaBH4 in methanol", CATALOG)
    start = time.process_time()
    read(text, CATALOG)
    assert time.process_time() - start < LIMIT_S


@pytest.mark.parametrize("part", [REALISTIC, TEXTS["letters after an amount"], TEXTS["radicals"]])
def test_a_text_of_the_greatest_length_is_written_or_refused_quickly(part: str) -> None:
    synthesize("Reduce benzophenone (1.8 g) with NaBH4 (0.2 g) in methanol (20 mL) at 0 C", keyword_only=True)
    start = time.process_time()
    with contextlib.suppress(LabgymError):
        synthesize((part * MAX_TEXT)[:MAX_TEXT], keyword_only=True)
    assert time.process_time() - start < LIMIT_S


def test_a_longer_text_is_refused_in_one_line() -> None:
    with pytest.raises(RefusalError, match=f"{20 * MAX_TEXT} characters"):
        synthesize("a" * (20 * MAX_TEXT), keyword_only=True)
