"""Open substances: what a protocol and a layout embed reloads without a catalog, and never weakens a hazard."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys

import pytest

from labgym.assets import Catalog, Substance
from labgym.assets.compatibility import UNCLASSIFIED, incompatible
from labgym.errors import DocumentError, LabgymError
from labgym.layouts import Layout
from labgym.layouts.stocking import plan_cabinets
from labgym.protocols import Protocol, derive, get
from labgym.protocols.model import ReagentUse

rdkit = pytest.importorskip("rdkit")

UNKNOWN = Substance(
    name="CompoundSeven", names=("compound 7",), source="none", state="solid", flags=("flammable", "volatile_or_toxic")
)
NITRILE = {
    "name": "ThreeButenenitrile",
    "names": ("3-butenenitrile",),
    "smiles": "C=CCC#N",
    "source": "opsin",
    "state": "liquid",
    "flags": ("flammable", "volatile_or_toxic"),
    "groups": ("nitrile", "alkene"),
}


def with_substances(*substances: Substance) -> Protocol:
    """Return a published protocol that also uses substances in its first step."""
    published = get("con_01")
    first = published.steps[0].model_copy(
        update={"uses": (*published.steps[0].uses, *(substance.name for substance in substances))}
    )
    uses = tuple(ReagentUse(name=substance.name, role="reactant", amount="1 g") for substance in substances)
    fields = dict(published) | {
        "reagents": (*published.reagents, *uses),
        "steps": (first, *published.steps[1:]),
        "substances": substances,
    }
    return derive(Protocol(**fields))


def test_a_substance_without_a_structure_is_toxic_flammable_and_apart_from_what_reacts() -> None:
    asset = UNKNOWN.asset
    assert asset.category == UNCLASSIFIED
    assert asset.hazards.flammable
    assert asset.hazards.volatile_or_toxic
    assert asset.chemistry.storage_class == "Toxic"
    catalog = Catalog.published()
    for name in ("HydrochloricAcid", "AceticAcid", "SodiumHydroxide", "HydrogenPeroxide", "DeionizedWater", "Sodium"):
        assert incompatible(asset, catalog.get(name)) is not None, name
    assert incompatible(asset, catalog.get("Toluene")) is None


def test_each_bottle_of_unknown_content_has_a_cabinet_of_its_own() -> None:
    from labgym.layouts.generate import resolve_request

    other = UNKNOWN.model_copy(update={"name": "CompoundEight", "names": ("compound 8",)})
    cabinets = plan_cabinets(resolve_request(with_substances(UNKNOWN, other)))
    alone = [cabinet for cabinet in cabinets if any(asset.category == UNCLASSIFIED for asset in cabinet.reagents)]
    assert sorted(asset.name for cabinet in alone for asset in cabinet.reagents) == ["CompoundEight", "CompoundSeven"]
    assert len(alone) == 2


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"flags": ("volatile_or_toxic",)}, "flammable"),
        ({"groups": ("alkene",)}, "nitrile"),
        ({"groups": ("nitrile", "alkene", "spell")}, "'spell' is no reactive group"),
        ({"flash_point": -12.0, "flags": ()}, "its data implies flammable"),
        ({"smiles": "", "flags": ()}, "unknown structure"),
        ({"smiles": "", "groups": ("inert",)}, "without a structure"),
        ({"smiles": "C(C"}, "SMILES"),
        ({"smiles": "CP(=O)(F)OC(C)C"}, "chemical weapons"),
        ({"name": "../../etc"}, "name"),
        ({"density": -1.0}, "density"),
        ({"mass": 5.0}, "mass"),
    ],
)
def test_a_substance_that_understates_its_hazards_or_is_out_of_bounds_is_refused(change, match) -> None:
    Substance.model_validate(NITRILE)
    with pytest.raises(ValueError, match=match):
        Substance.model_validate(NITRILE | change)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"name": "Ethanol"}, "name of another asset"),
        ({"names": ("sodium cyanide",)}, "SodiumCyanide"),
        ({"names": ("nitrile 4", "nitric acid (68-70%)")}, "NitricAcid"),
    ],
)
def test_a_substance_never_takes_the_place_of_a_reagent_with_more_hazards(change, match) -> None:
    substance = Substance.model_validate(NITRILE | change)
    with pytest.raises(LabgymError, match=match):
        Catalog.published().including((substance,))


def test_every_reagent_of_the_catalog_keeps_its_hazards_next_to_a_substance() -> None:
    catalog = Catalog.published()
    extended = catalog.including((UNKNOWN,))
    assert [extended.get(asset.name) for asset in catalog] == list(catalog.assets)
    assert len(extended) == len(catalog) + 1
    assert extended.including((UNKNOWN,)) is extended
    assert pickle.loads(pickle.dumps(extended)) == extended
    assert Catalog.published().digest == catalog.digest


def test_a_protocol_embeds_its_substances_and_others_keep_their_bytes() -> None:
    protocol = with_substances(UNKNOWN)
    assert Protocol.parse(json.loads(json.dumps(protocol.to_json()))) == protocol
    assert "substances" not in get("con_01").to_json()
    stores = [rule for rule in protocol.chemical_constraints if rule.subject == UNKNOWN.name and rule.kind == "store"]
    assert [rule.object for rule in stores] == ["Toxic"]
    with pytest.raises(DocumentError, match="not among the reagents"):
        Protocol.parse(get("con_01").to_json() | {"substances": [UNKNOWN.model_dump(mode="json")]})


def test_a_layout_with_substances_reloads_in_another_process_with_the_same_hash(tmp_path) -> None:
    from labgym.layouts import Layout
    from labgym.layouts.floor import Floor
    from labgym.layouts.generate import resolve_request
    from labgym.layouts.placement import FLOOR, Placement

    protocol = with_substances(UNKNOWN, Substance.model_validate(NITRILE))
    floor: Floor = resolve_request(protocol).floor
    placements = tuple(
        Placement(id=f"bottle_{number}", asset=name, position=(1.0 + number, 1.0, 0.0), support=FLOOR)
        for number, name in enumerate(("CompoundSeven", "ThreeButenenitrile"))
    )
    layout = Layout(id="open", protocols=(protocol,), floor=floor, placements=placements)
    file = layout.save(tmp_path / "open.json")
    code = f"from labgym.layouts import Layout; print(Layout.load({str(file)!r}).hash)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == layout.hash
    assert Layout.load(file).asset("bottle_0").chemistry.storage_class == "Toxic"


def test_a_hostile_layout_is_one_error_that_names_the_file(tmp_path) -> None:
    from labgym.layouts.generate import resolve_request

    protocol = with_substances(Substance.model_validate(NITRILE))
    layout = Layout(id="open", protocols=(protocol,), floor=resolve_request(protocol).floor, placements=())
    body = json.dumps(layout.to_json()).replace("ThreeButenenitrile", "Acetonitrile")
    with pytest.raises(DocumentError, match="rename it"):
        Layout.parse(json.loads(body))
