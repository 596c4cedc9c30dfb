"""Surveys: what a laboratory lacks for experiments, and which purchases add most."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from labgym.assets import Catalog
from labgym.cli.app import main
from labgym.protocols.experiments import Action, Experiment, ExperimentFile, Material, Portion
from labgym.protocols.experiments.needs import NeedsFinder, Shortfall
from labgym.protocols.experiments.survey import summarized, survey

CATALOG = Catalog.load()
EVERYTHING = [asset.name for asset in CATALOG.assets]


def experiment(number: int, *names: str, actions: tuple[Action, ...] = ()) -> Experiment:
    takes = tuple(Portion(name=name, amount="5 g") for name in names)
    return Experiment(
        id=f"x{number}",
        name="x",
        product="methyl benzoate",
        materials=tuple(Material(name=name, role="reagent") for name in names),
        actions=(Action(verb="Add", takes=takes), *actions, Action(verb="Stir", duration=60.0), Action(verb="Yield")),
    )


def lacking(experiment: Experiment, *without: str) -> Shortfall:
    return NeedsFinder(CATALOG, set(EVERYTHING) - set(without)).find(experiment)


def test_a_laboratory_with_everything_lacks_nothing_but_unknown_substances() -> None:
    assert lacking(experiment(1, "methanol")) == Shortfall((), ())
    assert lacking(experiment(1, "methanol", "unobtainium oxide")).lacking == (("unobtainium oxide",),)


def test_a_missing_reagent_is_named_as_the_catalog_names_it() -> None:
    assert lacking(experiment(1, "MeOH"), "Methanol").lacking == (("Methanol",),)


def test_of_several_devices_for_an_action_any_one_would_do() -> None:
    weak = Action(verb="AdjustPH", ph=7.0)
    found = lacking(experiment(1, "methanol", actions=(weak,)), "PHMeter", "PHPaper")
    assert ("PHMeter", "PHPaper") in found.lacking
    assert lacking(experiment(1, "methanol", actions=(weak,)), "PHMeter").lacking == ()


def test_instruments_that_reach_a_condition_are_the_alternatives() -> None:
    hot = Action(verb="Heat", temperature=150.0, duration=60.0)
    instruments = [asset.name for asset in CATALOG.of_kind("instrument")]
    mild = Action(verb="Heat", temperature=60.0, duration=60.0)
    found = lacking(experiment(1, "water", actions=(mild,)), *instruments).lacking
    assert any("OilBath" in alternatives and "WaterBath" in alternatives for alternatives in found)
    found = lacking(experiment(1, "water", actions=(hot,)), *instruments).lacking
    assert any("OilBath" in alternatives for alternatives in found)
    assert not any("WaterBath" in alternatives for alternatives in found)


def test_what_no_instrument_reaches_is_a_flaw() -> None:
    impossible = Action(verb="Heat", temperature=2900.0, duration=60.0)
    assert lacking(experiment(1, "water", actions=(impossible,))).flaws == ("temperature",)
    assert lacking(experiment(1, "water", actions=(Action(verb="Note", note="sing"),))).flaws == ("incomplete",)


def test_the_purchase_that_completes_most_experiments_comes_first() -> None:
    needs = [
        Shortfall((), ()),
        *[Shortfall((("Benzaldehyde",),), ())] * 3,
        *[Shortfall((("Aniline",),), ())] * 2,
        Shortfall((("Aniline",), ("Benzaldehyde",)), ()),
        Shortfall((("Aniline", "Benzaldehyde"), ("PHMeter",)), ()),
        Shortfall((("Aniline",),), ("unsafe",)),
    ]
    found = summarized("lab", needs, CATALOG)
    assert (found.experiments, found.possible, found.lacking, found.flawed) == (9, 1, 7, {"unsafe": 1})
    assert [(item.name, item.adds, item.possible) for item in found.purchases] == [
        *(("Benzaldehyde", 3, 4), ("Aniline", 3, 7), ("PHMeter", 1, 8))
    ]
    assert [item.lacking for item in found.purchases] == [5, 5, 1]
    assert "1 of 9 experiments" in found.table().text()


def test_without_a_purchase_that_completes_one_the_nearest_experiments_count() -> None:
    needs = [
        Shortfall((("Aniline",), ("Urea",)), ()),
        *[Shortfall((("Ethanol",), ("PHMeter",), ("Benzaldehyde",)), ())] * 2,
    ]
    found = summarized("lab", needs, CATALOG)
    assert [item.adds for item in found.purchases][:2] == [0, 1]
    assert {item.name for item in found.purchases[:2]} == {"Aniline", "Urea"}


def test_the_command_writes_the_survey_and_resumes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data, laboratory, out = tmp_path / "data.json", tmp_path / "lab.csv", tmp_path / "survey"
    items = (experiment(1, "methanol"), experiment(2, "aniline"))
    data.write_text(json.dumps(ExperimentFile(experiments=items).to_json()), encoding="utf-8")
    owned = [name for name in EVERYTHING if name != "Aniline"]
    laboratory.write_text("asset,count\n" + "".join(f"{name},1\n" for name in owned), encoding="utf-8")
    command = ["protocols", "survey", str(data), "--laboratory", str(laboratory), "--out", str(out)]
    assert main(command) == 0
    printed = capsys.readouterr().out
    assert "1 of 2 experiments" in printed
    assert "Aniline" in printed
    assert (out / "survey.png").read_bytes().startswith(b"\x89PNG")
    first = (out / "survey.json").read_bytes()
    assert main(command) == 0
    assert (out / "survey.json").read_bytes() == first
    again = survey(data, laboratory.name, owned, tmp_path / "again", progress=False)
    assert (tmp_path / "again" / "survey.json").read_bytes() == first
    assert (tmp_path / "again" / "survey.png").read_bytes() == (out / "survey.png").read_bytes()
    assert again.purchases[0].name == "Aniline"


def test_a_laboratory_that_is_neither_layout_nor_inventory_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["protocols", "survey", "assets/experiments", "--laboratory", "lab.txt", "--out", str(tmp_path / "x")]
    assert main(command) == 2
    assert "neither the .json file of a layout nor a .csv inventory" in capsys.readouterr().err
