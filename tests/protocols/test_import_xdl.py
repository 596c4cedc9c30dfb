"""XDL files: what becomes of each step, and what hostile ones come to."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from labgym.errors import DocumentError, OptionError
from labgym.protocols.experiments import Experiment, Rejection
from labgym.protocols.importers import read, xdl

HEAD = """<?xdl version="1.0.0" ?>
<XDL><Synthesis>
  <Metadata product="methyl benzoate" description="An ester."/>
  <Hardware><Component id="reactor" type="reactor"/><Component id="separator" type="separator"/></Hardware>
  <Reagents>
    <Reagent name="benzoic acid" role="substrate"/><Reagent name="methanol" role="solvent"/>
    <Reagent name="sulfuric acid" role="catalyst"/><Reagent name="ether"/><Reagent name="magnesium sulfate"/>
  </Reagents>
  <Procedure>"""
TAIL = "</Procedure></Synthesis></XDL>"


def one(tmp_path: Path, steps: str, name: str = "Methyl Benzoate (1).xdl") -> Experiment | Rejection:
    file = tmp_path / name
    file.write_text(HEAD + steps + TAIL, encoding="utf-8")
    (found,) = read(file, "xdl")
    return found


def experiment(tmp_path: Path, steps: str) -> Experiment:
    found = one(tmp_path, steps)
    assert isinstance(found, Experiment), found
    return found


def test_a_synthesis_in_phases_becomes_an_experiment(tmp_path: Path) -> None:
    found = experiment(
        tmp_path,
        """<Prep><Add vessel="reactor" reagent="benzoic acid" mass="12.2 g"/>
             <Add vessel="reactor" reagent="methanol" volume="40 mL" stir="True"/></Prep>
           <Reaction><Add vessel="reactor" reagent="sulfuric acid" volume="3 mL" time="10 mins" dropwise="True"/>
             <HeatChill vessel="reactor" temp="65°C" time="2 hrs"/><StopHeatChill vessel="reactor"/></Reaction>
           <Workup><Separate purpose="extract" from_vessel="reactor" to_vessel="rotavap" solvent="ether"
             solvent_volume="30 mL" repeats="3" product_phase="top" through="magnesium sulfate"/></Workup>
           <Purification><Evaporate vessel="rotavap" temp="40°C" pressure="300 mbar" time="30 mins"/></Purification>""",
    )
    assert found.id == "xdl_methyl_benzoate_1"
    assert (found.name, found.product, found.origin) == ("methyl benzoate", "methyl benzoate", "xdl")
    assert {m.name: m.role for m in found.materials} == {
        "benzoic acid": "reactant",
        "methanol": "solvent",
        "sulfuric acid": "catalyst",
        "ether": "workup",
        "magnesium sulfate": "workup",
    }
    assert [action.verb for action in found.actions] == [
        *("Add", "Add", "Add", "Heat", "Extract", "DrySolution", "Concentrate", "Yield")
    ]
    dropped, heated, extracted, dried, evaporated = found.actions[2:7]
    assert (dropped.manner, dropped.duration, dropped.takes[0].amount) == ("dropwise", 10.0, "3 mL")
    assert (heated.temperature, heated.duration) == (65.0, 120.0)
    assert (extracted.takes[0].amount, extracted.note) == ("3 x 30 mL", "product in the top layer")
    assert dried.takes[0].name == "magnesium sulfate"
    assert (evaporated.temperature, evaporated.pressure) == (40.0, pytest.approx(0.3))


def test_the_older_shape_with_ids_and_no_outer_element_is_read(tmp_path: Path) -> None:
    file = tmp_path / "old.xdl"
    file.write_text(
        '<Synthesis organic_cleaning_solvent="toluene"><Hardware/><Reagents><Reagent id="water"/></Reagents><Procedure>'
        '<Add reagent="water" vessel="filter" volume="60 mL"/><HeatChillToTemp vessel="filter" temp="10"/>'
        '<Rotavap rotavap_name="rotavap" temp="40" pressure="750" time="1h"/>'
        '<WashSolid vessel="filter" solvent="water" volume="20 mL" repeat="6"/></Procedure></Synthesis>',
        encoding="utf-8",
    )
    (found,) = read(file, "xdl")
    assert isinstance(found, Experiment)
    assert [(a.verb, a.temperature, a.pressure) for a in found.actions[:3]] == [
        ("Add", None, None),
        ("SetTemperature", 10.0, None),
        ("Concentrate", 40.0, 0.75),
    ]
    assert found.actions[3].takes[0].amount == "6 x 20 mL"


@pytest.mark.parametrize("temp, verb", [("-78°C", "Cool"), ("0", "Cool"), ("25°C", "Stir"), ("353 K", "Heat")])
def test_heating_and_cooling_follow_from_the_temperature(tmp_path: Path, temp: str, verb: str) -> None:
    found = experiment(
        tmp_path, f'<Add reagent="ether" vessel="r"/><HeatChill vessel="r" temp="{temp}" time="3600 s"/>'
    )
    assert (found.actions[1].verb, found.actions[1].duration) == (verb, 60.0)


def test_repeated_steps_are_written_out(tmp_path: Path) -> None:
    found = experiment(
        tmp_path, '<Repeat repeats="3"><Add reagent="ether" vessel="r" volume="5 mL"/><Stir time="5 min"/></Repeat>'
    )
    assert [action.verb for action in found.actions] == ["Add", "Stir"] * 3 + ["Yield"]


@pytest.mark.parametrize("tag", sorted(xdl._STEPS))
def test_every_step_of_the_language_gives_an_action(tmp_path: Path, tag: str) -> None:
    found = experiment(tmp_path, f'<Add reagent="ether" vessel="r"/><{tag} reagent="methanol" solvent="methanol"/>')
    assert len(found.actions) == 3


def test_steps_that_tend_the_machine_are_left_out(tmp_path: Path) -> None:
    steps = "".join(f'<{tag} vessel="r"/>' for tag in sorted(xdl.MACHINE))
    assert len(experiment(tmp_path, f'<Add reagent="ether" vessel="r"/>{steps}').actions) == 2


@pytest.mark.parametrize(
    "steps, reason",
    [
        ('<Repeat repeats="often"><Stir time="5 min"/></Repeat>', "number of repeats"),
        ('<Repeat repeats="9999"/>', "number of repeats"),
        ('<Repeat repeats="300"><Repeat repeats="300"><Stir/></Repeat></Repeat>', "more than 300 actions"),
        ('<Add reagent="' + "x" * 300 + '" vessel="r"/>', "200 characters"),
        ('<Stir time="5 min"/>', "materials"),
    ],
)
def test_a_synthesis_that_cannot_be_told_is_turned_down_with_the_reason(
    tmp_path: Path, steps: str, reason: str
) -> None:
    found = one(tmp_path, steps)
    assert isinstance(found, Rejection)
    assert reason in found.reason


def test_an_unknown_step_becomes_a_note(tmp_path: Path) -> None:
    found = experiment(tmp_path, '<Add reagent="ether" volume="1 mL"/><Teleport vessel="r" to="Mars"/>')
    assert [(action.verb, action.note) for action in found.actions[1:-1]] == [("Note", "Teleport: vessel r, to Mars")]


def test_a_repeat_without_a_number_is_done_once_with_a_note(tmp_path: Path) -> None:
    found = experiment(tmp_path, '<Repeat><Add reagent="ether" volume="1 mL"/></Repeat>')
    assert [action.verb for action in found.actions] == ["Add", "Note", "Yield"]


def test_a_repeat_over_reagents_takes_each_in_turn(tmp_path: Path) -> None:
    for condition, names in (
        ("rx.role='substrate'", ["benzoic acid"]),
        ("rx.kind='Reagent'", ["benzoic acid", "methanol", "sulfuric acid", "ether", "magnesium sulfate"]),
        ("rx.kind='Reagent' rx.role='solvent' v.kind='Hardware'", ["methanol", "methanol"]),
    ):
        found = experiment(tmp_path, f"<Repeat {condition}><Add reagent='rx' amount='2 mL'/></Repeat>")
        assert [portion.name for action in found.actions for portion in action.takes] == names


BLUEPRINTS = """<XDL>
<Blueprint id="Wash_Twice"><Parameters><Parameter id="much" type="volume" value="5 mL"/></Parameters>
  <Reagents><Reagent id="liquid"/></Reagents>
  <Procedure><Repeat repeats="2"><WashSolid solvent="liquid" param.volume="much"/></Repeat></Procedure></Blueprint>
<Blueprint id="Work_Up"><Parameters><Parameter id="pause" value="3 min"/></Parameters>
  <Reagents><Reagent id="a"/></Reagents>
  <Procedure><Wash_Twice liquid="a" much="7 mL"/><Wash_Twice liquid="water"/><Wait time="pause"/></Procedure>
</Blueprint>
%s</XDL>"""


def test_blueprints_are_carried_out_with_their_arguments(tmp_path: Path) -> None:
    file = tmp_path / "a.xdl"
    synthesis = '<Synthesis><Reagents/><Procedure><Work_Up a="ether"/></Procedure></Synthesis>'
    file.write_text(BLUEPRINTS % synthesis)
    (found,) = read(file, "xdl")
    assert isinstance(found, Experiment)
    taken = [(portion.name, portion.amount) for action in found.actions for portion in action.takes]
    assert taken == [("ether", "7 mL")] * 2 + [("water", "5 mL")] * 2
    assert found.actions[-2].duration == 3.0


def test_a_file_of_blueprints_alone_is_read_with_the_reagents_of_the_first(tmp_path: Path) -> None:
    file = tmp_path / "a.xdl"
    file.write_text(BLUEPRINTS % "")
    (found,) = read(file, "xdl")
    assert isinstance(found, Experiment)
    assert [material.name for material in found.materials] == ["liquid"]


@pytest.mark.parametrize(
    "content",
    [
        '<XDL><Blueprint id="A"><Procedure><A/></Procedure></Blueprint>'
        "<Synthesis><Procedure><A/></Procedure></Synthesis></XDL>",
        '<XDL><Blueprint id="A"><Procedure><A/><A/></Procedure></Blueprint>'
        "<Synthesis><Procedure><A/></Procedure></Synthesis></XDL>",
        "<Synthesis><Reagents>"
        + "<Reagent name='x'/>" * 2000
        + "</Reagents><Procedure><Repeat a.kind='Reagent' b.kind='Reagent' c.kind='Reagent'/></Procedure></Synthesis>",
        "<XDL><Blueprint id='A'><Reagents>"
        + "<Reagent name='x'/>" * 5000
        + "</Reagents><Procedure><Stir/></Procedure></Blueprint><Synthesis><Procedure>"
        + "<A/>" * 5000
        + "</Procedure></Synthesis></XDL>",
    ],
    ids=["endless", "doubling", "product", "arguments"],
)
def test_endless_blueprints_and_repeats_are_one_rejection(tmp_path: Path, content: str) -> None:
    file = tmp_path / "a.xdl"
    file.write_text(content)
    (found,) = read(file, "xdl")
    assert isinstance(found, Rejection)
    assert "more than" in found.reason


BOMB = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;">]><Synthesis>&b;</Synthesis>'
OUTSIDE = '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]><Synthesis>&a;</Synthesis>'


@pytest.mark.parametrize(
    "content, problem",
    [
        (BOMB.encode(), "document type definition"),
        (OUTSIDE.encode(), "document type definition"),
        (BOMB.encode("utf-16"), "document type definition"),
        (b"<Synthesis><Procedure>", "not XML"),
        (b"", "not XML"),
        (b"PK\x03\x04\x00\x00", "not XML"),
        (b'<?xml version="1.0" encoding="klingon"?><Synthesis/>', "XML|encoding"),
        (b"<html/>", "no Synthesis"),
        (b"<a>" * 100 + b"</a>" * 100, "levels deep"),
        (b"<Synthesis>" + b"<a/>" * 30_000 + b"</Synthesis>", "elements long"),
    ],
)
def test_hostile_and_broken_files_are_refused(tmp_path: Path, content: bytes, problem: str) -> None:
    file = tmp_path / "x.xdl"
    file.write_bytes(content)
    with pytest.raises(DocumentError, match=problem):
        list(read(file, "xdl"))


def test_a_file_without_bounds_is_not_read_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xdl, "MAX_BYTES", 100)
    file = tmp_path / "x.xdl"
    file.write_text(HEAD + TAIL)
    with pytest.raises(DocumentError, match="larger than"):
        list(read(file, "xdl"))


def test_in_a_folder_a_broken_file_does_not_stop_the_others(tmp_path: Path) -> None:
    one(tmp_path, '<Add reagent="ether" vessel="r"/>', "a.xdl")
    (tmp_path / "b.xml").write_text("<broken")
    one(tmp_path, '<Add reagent="methanol" vessel="r"/>', "c.xdl")
    found = list(read(tmp_path, "xdl"))
    assert [type(item) for item in found] == [Experiment, Rejection, Experiment]
    assert isinstance(found[1], Rejection)
    assert found[1].place == "b.xml"


def test_an_empty_folder_is_told(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match="no XDL files"):
        list(read(tmp_path, "xdl"))


def test_empty_repeats_in_repeats_come_to_an_end(tmp_path: Path) -> None:
    steps = '<Repeat repeats="300">' * 6 + "</Repeat>" * 6
    found = one(tmp_path, f'<Add reagent="ether" vessel="r"/>{steps}')
    assert isinstance(found, Rejection)
    assert "20000 steps" in found.reason


@pytest.mark.parametrize("times", ["9" * 5000, "-1", "two", "1.5", "\u0663"])
def test_a_number_of_repeats_that_is_none_is_turned_down(tmp_path: Path, times: str) -> None:
    found = one(tmp_path, f'<Repeat repeats="{times}"><Add reagent="ether" vessel="r"/></Repeat>')
    assert isinstance(found, Rejection)


def test_conditions_that_cannot_be_read_are_kept_in_words(tmp_path: Path) -> None:
    found = experiment(tmp_path, '<Add reagent="ether" vessel="r"/><HeatChill temp="reflux" time="1h 30min"/>')
    assert (found.actions[1].verb, found.actions[1].note) == ("Heat", "temp reflux; time 1h 30min")


def test_files_of_one_name_in_two_folders_are_two_experiments(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        one(tmp_path / folder, '<Add reagent="ether" vessel="r"/>', "x.xdl")
    assert [item.id for item in read(tmp_path, "xdl") if isinstance(item, Experiment)] == ["xdl_a_x", "xdl_b_x"]


@pytest.mark.parametrize("encoding", ["gb18030", "shift_jis", "big5", "euc-kr", "utf-7"])
def test_an_encoding_of_several_bytes_is_one_line_and_does_not_stop_a_folder(tmp_path: Path, encoding: str) -> None:
    one(tmp_path, '<Add reagent="ether" vessel="r"/>', "a.xdl")
    content = f'<?xml version="1.0" encoding="{encoding}"?>' + HEAD.partition("?>")[2] + TAIL
    (tmp_path / "b.xdl").write_bytes(content.encode("ascii"))
    one(tmp_path, '<Add reagent="ether" vessel="r"/>', "c.xdl")
    first, second, third = read(tmp_path, "xdl")
    assert isinstance(first, Experiment)
    assert isinstance(third, Experiment)
    assert isinstance(second, Rejection)
    assert "UTF-8" in second.reason
    with pytest.raises(DocumentError, match="save it as UTF-8"):
        list(read(tmp_path / "b.xdl", "xdl"))


def without_product(tmp_path: Path, metadata: str, name: str = "methyl benzoate.xdl") -> Path:
    file = tmp_path / name
    steps = '<Add reagent="benzoic acid" mass="12.2 g" vessel="r"/><HeatChill temp="65 C" time="2 h" vessel="r"/>'
    text = HEAD.replace('<Metadata product="methyl benzoate" description="An ester."/>', metadata) + steps + TAIL
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize(
    "metadata, given, product",
    [
        ("", "", ""),
        ("", "an ester", "an ester"),
        ("", "{stem}", "methyl benzoate"),
        ('<Metadata description="Synthesis of lidocaine"/>', "", "lidocaine"),
        ('<Metadata description="The preparation of aspirin."/>', "an ester", "aspirin"),
        ('<Metadata description="Fast and clean"/>', "", ""),
        ('<Metadata product="aspirin"/>', "an ester", "aspirin"),
    ],
)
def test_the_product_is_that_of_the_metadata_else_the_one_given(
    tmp_path: Path, metadata: str, given: str, product: str
) -> None:
    (found,) = read(without_product(tmp_path, metadata), "xdl", product=given)
    assert isinstance(found, Experiment)
    assert found.product == product


def test_a_product_for_another_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="xdl only"):
        read(tmp_path, "ord", product="aspirin")


def test_a_pressure_that_cannot_be_read_is_kept_in_words(tmp_path: Path) -> None:
    found = experiment(tmp_path, '<Add reagent="ether" vessel="r"/><Evaporate pressure="deep" temp="40 C"/>')
    assert found.actions[1].note == "pressure deep"
    assert found.actions[1].pressure is None


@pytest.mark.parametrize("amount", ["1e308 mL", "nan mL", "-inf g", "1.2.3 mL", "5 furlongs"])
def test_an_amount_that_cannot_be_read_is_turned_down(tmp_path: Path, amount: str) -> None:
    found = one(tmp_path, f'<Add reagent="ether" vessel="r" volume="{amount}"/>')
    assert isinstance(found, Rejection)
    assert amount in found.reason


@pytest.mark.parametrize("amount", ["5 mL", "5", "2 x 30 mL", "1.1 equiv", "a few drops", "some", "10-20 mL"])
def test_an_amount_that_can_be_read_is_kept(tmp_path: Path, amount: str) -> None:
    found = experiment(tmp_path, f'<Add reagent="ether" vessel="r" amount="{amount}"/>')
    assert found.actions[0].takes[0].amount == amount


def test_what_is_neither_file_nor_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "loop.xdl").symlink_to(tmp_path / "loop.xdl")
    os.mkfifo(tmp_path / "pipe.xdl")
    for name in ("loop.xdl", "pipe.xdl"):
        with pytest.raises(OptionError, match=name):
            list(read(tmp_path / name, "xdl"))
