"""Identities and hazards of reagents agree with arithmetic and with rules written down a second time."""

from __future__ import annotations

import re

import pytest
from every_case import for_each

from labgym.assets import Catalog, flags
from labgym.assets.checks import cas_is_valid
from labgym.assets.model import Chemistry

REAGENTS = Catalog.load().of_kind("reagent")
each = for_each("asset", REAGENTS)

# Standard atomic weights, IUPAC 2021, abridged.
WEIGHTS = {
    "H": 1.008, "Li": 6.94, "B": 10.81, "C": 12.011, "N": 14.007, "O": 15.999, "F": 18.998, "Na": 22.990,
    "Mg": 24.305, "Al": 26.982, "Si": 28.085, "P": 30.974, "S": 32.06, "Cl": 35.45, "Ar": 39.95, "K": 39.098,
    "Ca": 40.078, "Ti": 47.867, "Cr": 51.996, "Mn": 54.938, "Fe": 55.845, "Ni": 58.693, "Cu": 63.546, "Zn": 65.38,
    "Br": 79.904, "Pd": 106.42, "Ag": 107.87, "Sn": 118.71, "I": 126.90, "Cs": 132.91,
}  # fmt: skip


@each
def test_cas_numbers_pass_their_check_digit(asset):
    digits = asset.chemistry.cas.replace("-", "")
    weighted = sum(int(digit) * (len(digits) - 1 - place) for place, digit in enumerate(digits[:-1]))
    assert weighted % 10 == int(digits[-1])
    assert cas_is_valid(asset.chemistry.cas)


@pytest.mark.parametrize("number", ["64-17-6", "64-71-5", "064-17-5", "64175", "64-17-5 ", "", "12345678-12-1", "乙醇"])
def test_wrong_cas_numbers_are_told(number):
    assert not cas_is_valid(number)


@pytest.mark.parametrize("number", ["7732-18-5", "58-08-2", "50-00-0", "7440-44-0"])
def test_right_cas_numbers_are_accepted(number):
    assert cas_is_valid(number)


@each
def test_molar_mass_is_that_of_the_formula(asset):
    chemistry = asset.chemistry
    if chemistry.formula is None or chemistry.molar_mass is None:
        assert asset.name in {"PetroleumEther", "Xylene", "Celite", "MolecularSieves"}
        return
    parts = re.findall(r"([A-Z][a-z]?)(\d*)", chemistry.formula)
    assert "".join(element + count for element, count in parts) == chemistry.formula
    mass = sum(WEIGHTS[element] * int(count or 1) for element, count in parts)
    assert chemistry.molar_mass == pytest.approx(mass, rel=0.002, abs=0.02)


@each
def test_physical_data_are_physical(asset):
    chemistry = asset.chemistry
    if chemistry.state == "liquid" and asset.name != "BenzylTBSEther":  # its density is not published
        assert chemistry.density is not None
        assert 0.6 <= chemistry.density <= 3.2
    if chemistry.flash_point is not None and chemistry.boiling_point is not None:
        assert chemistry.flash_point < chemistry.boiling_point
    if chemistry.nfpa is not None:
        assert all(0 <= rating <= 4 for rating in chemistry.nfpa)
    assert all(re.fullmatch(r"(EU)?H\d{3}[A-Za-z]{0,2}", code) for code in chemistry.h_codes)


@each
def test_low_flash_points_and_fire_statements_mean_flammable(asset):
    chemistry = asset.chemistry
    fire = any(re.match(r"H(203|22[0-8]|24[12]|25[0-2]|260)", code) for code in chemistry.h_codes)
    burns = fire or (chemistry.flash_point is not None and chemistry.flash_point <= 60)
    assert asset.hazards.flammable == burns or (asset.name, "flammable") in flags.exceptions()


@each
def test_poisons_and_low_boilers_mean_volatile_or_toxic(asset):
    chemistry = asset.chemistry
    codes = " ".join(chemistry.h_codes)
    poison = re.search(r"\bH(300|301|310|311|330|331|340|350|360)|EUH029", codes) is not None
    liquid = chemistry.state == "liquid"
    chronic = chemistry.state != "solid" and re.search(r"\bH(351|361|370|372)", codes) is not None
    vapour = liquid and (re.search(r"\bH22[45]", codes) is not None or {"H314", "H332"} <= set(chemistry.h_codes))
    fumes = liquid and {"H314", "H335"} <= set(chemistry.h_codes)
    boils = chemistry.state == "liquid" and chemistry.boiling_point is not None and chemistry.boiling_point <= 100
    expected = poison or chronic or vapour or fumes or (boils and asset.name != "DeionizedWater")
    assert asset.hazards.volatile_or_toxic == expected or (asset.name, "volatile_or_toxic") in flags.exceptions()


@pytest.mark.parametrize(
    ("flag", "pattern"), [("oxidizer", r"H27[0-2]"), ("explosive", r"H(20[0-5]|24[0-2])"), ("flammable", r"H22[456]")]
)
def test_statements_always_show_in_their_flag(flag, pattern):
    for asset in REAGENTS:
        if any(re.match(pattern, code) for code in asset.chemistry.h_codes):
            assert getattr(asset.hazards, flag), asset.name


@each
def test_flags_follow_from_the_data_or_are_listed_as_exceptions(asset):
    rule, carried = flags.by_rule(asset.chemistry), flags.carried(asset)
    differ = {flag for flag in flags.FLAGS if rule[flag] != carried[flag]}
    assert differ == {flag for name, flag in flags.exceptions() if name == asset.name}


@each
def test_acid_and_base_follow_from_groups_and_corrosion(asset):
    groups, codes = set(asset.chemistry.groups), set(asset.chemistry.h_codes)
    corrodes = bool(codes & {"H290", "H314"})
    acid = bool(groups & {"strong_acid", "oxidizing_acid", "carboxylic_acid", "lewis_acid"})
    acid |= corrodes and bool(groups & {"weak_acid", "acidic_salt", "phenol"})
    strong = {"strong_base", "weak_base", "amine", "ammonia", "carbonate", "sulfide", "cyanide", "hypochlorite"}
    base = bool(groups & {*strong, "organometallic"})
    base |= corrodes and bool("hydrazine" in groups or ("metal_hydride" in groups and asset.chemistry.state == "solid"))
    base |= "basic_salt" in groups and bool(codes & {"H314", "H315", "H318", "H319"})
    assert asset.hazards.acid == acid or (asset.name, "acid") in flags.exceptions()
    assert asset.hazards.base == base or (asset.name, "base") in flags.exceptions()


def test_exceptions_are_few():
    assert len(flags.exceptions()) <= 22


def test_a_clause_asks_for_all_that_it_names():
    liquid = Chemistry(state="liquid", h_codes=("H314", "H361fd"), groups=("hydrazine",), storage_class="General")
    solid = liquid.model_copy(update={"state": "solid"})
    clause = flags.FlagRule("base", ("H314",), groups=("hydrazine",), also=("H361",), states=("liquid",))
    assert clause.holds(liquid)
    assert not clause.holds(solid)
    assert not clause.holds(liquid.model_copy(update={"groups": ()}))
    assert not clause.holds(liquid.model_copy(update={"h_codes": ("H314",)}))


def test_each_exception_is_needed_and_has_a_reason():
    by_name = {asset.name: asset for asset in REAGENTS}
    for (name, flag), exception in flags.exceptions().items():
        assert flags.by_rule(by_name[name].chemistry)[flag] != exception.value
        assert len(exception.reason) > 10


@each
def test_storage_fits_the_hazard(asset):
    hazards, chemistry = asset.hazards, asset.chemistry
    if chemistry.state == "gas":
        assert chemistry.storage_class == "Gas"
    if chemistry.storage_class == "General":
        assert not hazards.oxidizer
        assert chemistry.state != "liquid" or not hazards.flammable
    if chemistry.state == "liquid" and hazards.flammable:
        assert chemistry.storage_class in {"Flammable", "WaterReactive", "Refrigerator"}
    if chemistry.storage_class in {"Acid", "Base"}:
        assert hazards.acid == (chemistry.storage_class == "Acid")
        assert hazards.base == (chemistry.storage_class == "Base")


@each
def test_captions_recommend_the_place_that_the_data_name(asset):
    words = {
        "Flammable": "flammables cabinet", "Acid": "acid cabinet", "Base": "base cabinet",
        "Oxidizer": "oxidiser cabinet", "Toxic": "toxics cabinet", "WaterReactive": "water-reactive cabinet",
        "Refrigerator": "refrigerator", "Gas": "gas cabinet", "General": "general cabinet",
    }  # fmt: skip
    assert words[asset.chemistry.storage_class] in asset.caption.lower()


@each
def test_packs_weigh_what_they_hold(asset):
    specs, size = asset.specs, asset.size
    if specs.pack_mL is not None:
        volume = specs.pack_mL * 1e-6
        assert volume < size.width * size.depth * size.height
        assert asset.mass > volume * 1000 * (asset.chemistry.density or 0.9)
    if specs.pack_g is not None:
        assert asset.mass > specs.pack_g / 1000


def test_pyrophoric_is_what_ghs_says_and_changes_no_digest():
    stated = {asset.name for asset in REAGENTS if "H250" in asset.chemistry.h_codes}
    assert {asset.name for asset in REAGENTS if asset.chemistry.pyrophoric} == stated
    assert stated == {"NButyllithium", "DIBALH", "RaneyNickel"}
    asset = REAGENTS[0]
    other = asset.model_copy(update={"chemistry": asset.chemistry.model_copy(update={"pyrophoric": True})})
    assert other.digest == asset.digest
