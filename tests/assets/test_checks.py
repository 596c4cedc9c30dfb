"""The published catalogue is sound, and each check tells of the fault that it is for."""

from __future__ import annotations

import pytest
from every_case import for_each

from labgym.assets import Catalog, Cavity, Hazards, Size, Surface
from labgym.assets.checks import check
from labgym.assets.plausibility import bounds, size_problem

CATALOG = Catalog.load()


def problems_of(name, **changes):
    changed = CATALOG.get(name).model_copy(update=changes)
    others = [asset for asset in CATALOG if asset.name != name]
    return [(problem.asset, problem.field) for problem in check(Catalog([*others, changed]))]


def chemistry(name, **changes):
    return CATALOG.get(name).chemistry.model_copy(update=changes)


def test_the_published_catalogue_has_no_problem():
    assert check(CATALOG) == ()


HOOD = CATALOG.get("FumeHood")
FAULTS = [
    ("Beaker", "size", {"size": Size(width=7.0, depth=7.0, height=9.5)}),
    ("Beaker", "mass", {"mass": 900.0}),
    ("Beaker", "mass", {"mass": 0.0001}),
    ("Beaker", "description", {"description": "A beaker."}),
    ("Beaker", "caption", {"caption": ""}),
    ("Beaker", "synonyms_zh", {"synonyms_zh": ()}),
    ("Beaker", "synonyms", {"synonyms_en": ("fume cupboard",)}),
    ("Beaker", "hazards.glass_container", {"hazards": Hazards()}),
    ("Beaker", "mount_height", {"mount_height": 1.0}),
    ("Beaker", "chemistry", {"kind": "reagent"}),
    ("OilBath", "heat_class", {"heat_class": None}),
    ("Ethanol", "placing", {"placing": "floor"}),
    ("Ethanol", "chemistry.cas", {"chemistry": chemistry("Ethanol", cas="64-17-6")}),
    ("Ethanol", "chemistry.nfpa", {"chemistry": chemistry("Ethanol", nfpa=(2, 3, 5))}),
    ("Ethanol", "chemistry.groups", {"chemistry": chemistry("Ethanol", groups=("spirit",))}),
    ("Ethanol", "flammable", {"hazards": Hazards(volatile_or_toxic=True)}),
    ("Ethanol", "oxidizer", {"chemistry": chemistry("Ethanol", h_codes=("H225", "H272"))}),
    ("AcidCabinet", "cavity", {"cavity": None, "surfaces": ()}),
    ("FumeHood", "cavity", {"cavity": None, "surfaces": ()}),
    ("FumeHood", "cavity", {"cavity": Cavity(width=1.6, depth=0.7, z0=0.9, z1=2.1)}),
    ("FumeHood", "surfaces", {"surfaces": ()}),
    ("FumeHood", "surfaces.0", {"surfaces": (Surface(z=0.9, width=1.4, depth=0.7, y=0.025, headroom=1.2),)}),
    ("FumeHood", "surfaces.0", {"surfaces": (Surface(z=0.5, width=1.0, depth=0.5, headroom=1.2),)}),
    ("FumeHood", "surfaces.0.headroom", {"surfaces": (Surface(z=0.9, width=1.3, depth=0.7, y=0.025, headroom=1.4),)}),
    ("FumeHood", "surfaces.0.headroom", {"surfaces": (Surface(z=0.9, width=1.3, depth=0.7, y=0.025),)}),
    ("LabBench", "surfaces.0", {"surfaces": (Surface(z=0.9, width=1.7, depth=0.75),)}),
]


@pytest.mark.parametrize(
    ("name", "field", "changes"), FAULTS, ids=[f"{n}-{f}-{i}" for i, (n, f, _) in enumerate(FAULTS)]
)
def test_a_fault_is_found_and_its_field_named(name, field, changes):
    assert (name, field) in problems_of(name, **changes)


@for_each("asset", CATALOG.assets)
def test_a_thousandfold_size_is_never_plausible(asset):
    for factor in (1000.0, 0.001):
        sides = {side: value * factor for side, value in asset.size.model_dump().items()}
        assert size_problem(asset.model_copy(update={"size": Size.model_construct(**sides)})) is not None


@for_each("asset", CATALOG.assets)
def test_sizes_lie_in_their_bounds(asset):
    allowed = bounds(asset)
    assert all(allowed.least <= side <= allowed.greatest for side in asset.size.model_dump().values())


def test_texts_are_not_one_template():
    for field in ("description", "caption"):
        texts = [getattr(asset, field) for asset in CATALOG]
        assert len(set(texts)) == len(texts)
        openings = [" ".join(text.split()[:4]) for text in texts]
        assert max(openings.count(opening) for opening in set(openings)) <= 6
