"""Sentences that name reagents which the user has added: they fill the slots that their structure fits."""

from __future__ import annotations

import pytest

from labgym.assets import Catalog
from labgym.assets.forge import OwnAssets
from labgym.protocols.errors import RefusalError
from labgym.protocols.model import Protocol
from labgym.protocols.synthesis import synthesize
from labgym.protocols.synthesis.transformations import classes_of, transformations

pytest.importorskip("rdkit")
OWN = {
    "4-methylbenzaldehyde": "Cc1ccc(C=O)cc1",
    "N-Boc-4-methylaniline": "CC(C)(C)OC(=O)Nc1ccc(C)cc1",
    "4-fluorobenzyl alcohol": "OCc1ccc(F)cc1",
    "4-fluorobenzylamine": "NCc1ccc(F)cc1",
    "glycine": "NCC(=O)O",
}


@pytest.fixture(scope="module")
def catalog(tmp_path_factory):
    from labgym.assets.inference import infer

    own = OwnAssets(tmp_path_factory.mktemp("own"))
    for name, smiles in OWN.items():
        own.add_reagent(infer(smiles, name))
    return Catalog.load(own.folder)


def written(text: str, catalog: Catalog) -> Protocol:
    return synthesize(text, keyword_only=True, catalog=catalog).protocol


@pytest.mark.parametrize(
    ("text", "name", "like"),
    [
        ("Reduce 4-methylbenzaldehyde with NaBH4 in methanol at 0 C", "4-methylbenzaldehyde", "borohydride_reduction"),
        ("Deprotect N-Boc-4-methylaniline with TFA in DCM, evaporate", "N-Boc-4-methylaniline", "boc_removal"),
        (
            "Silylate 4-fluorobenzyl alcohol with TBSCl, imidazole",
            "4-fluorobenzyl alcohol",
            "silyl_protection",
        ),
        ("Protect 4-fluorobenzylamine with Boc2O in DCM", "4-fluorobenzylamine", "boc_protection"),
    ],
)
def test_a_reagent_of_the_user_is_the_substrate_and_is_stored_as_its_own_class(catalog, text, name, like):
    protocol, asset = written(text, catalog), catalog.find(name)
    assert protocol.id.startswith(like)
    assert {use.name: use.role for use in protocol.reagents}[asset.name] == "substrate"
    stores = [c for c in protocol.chemical_constraints if c.kind == "store" and c.subject == asset.name]
    assert [c.object for c in stores] == [asset.chemistry.storage_class]


def test_the_amount_of_the_user_s_reagent_sets_the_batch(catalog):
    protocol = written("Reduce 12.0 g of 4-methylbenzaldehyde with NaBH4 in ethanol", catalog)
    amounts = {use.name: use.amount for use in protocol.reagents}
    # 12.0 g / 120.15 g/mol = 99.9 mmol; the table takes 15 mmol of borohydride for 20 mmol.
    assert amounts[catalog.find("4-methylbenzaldehyde").name] == "12.0 g"
    assert "74.9 mmol" in amounts["SodiumBorohydride"]


def test_a_reagent_of_another_class_is_refused_by_name_with_what_would_fit(catalog):
    with pytest.raises(RefusalError, match=r"among Glycine.*Benzophenone.*or a ketone or an aldehyde of your own"):
        written("Reduce glycine with NaBH4 in ethanol", catalog)
    with pytest.raises(RefusalError, match="no substrate"):  # an aliphatic amine gives no stable diazonium salt
        written("Diazotise 4-fluorobenzylamine with sodium nitrite and HCl, then Sandmeyer with CuCl", catalog)


def test_each_stand_in_has_the_structure_of_its_class():
    table, catalog = transformations(), Catalog.published()
    assert set(table.structures) == set(table.stand_ins)
    for name, asset in table.stand_ins.items():
        assert name in classes_of(catalog.get(asset))
