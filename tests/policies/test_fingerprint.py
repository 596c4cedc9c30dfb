"""The fingerprint of a policy: equal in every process, different for everything that changes how it drives."""

from __future__ import annotations

import collections
import dataclasses
import functools
import json
import os
import subprocess
import sys
import threading
import types
from collections import deque
from enum import Enum
from pathlib import Path

import numpy as np
import pytest
from notebook_policies import notebook_policy
from pydantic import BaseModel

from labgym.errors import OptionError
from labgym.policies import EpisodeStart, Policy, make_policy
from labgym.policies.fingerprint.policy import named_fingerprint, object_fingerprint
from labgym.policies.options import PolicyOptions


class Driver(Policy):
    """Drives by its parameter."""

    def __init__(self, parameter: object = None) -> None:
        self.parameter = parameter

    def reset(self, episode: EpisodeStart) -> None:
        pass

    def act(self, observation):
        return np.zeros(2)


class Color(Enum):
    RED = 1
    BLUE = 2


@dataclasses.dataclass
class Gains:
    forward: float
    turn: float = 1.0


class Limits(BaseModel):
    top: float


class FrozenList(list):
    """A subclass of a container."""


Place = collections.namedtuple("Place", ("x", "y"))


class Memory:
    """A plain class with slots."""

    __slots__ = ("places",)

    def __init__(self, places: list[int]) -> None:
        self.places = places


DIFFERENT = [
    None,
    False,
    0,
    0.0,
    -0.0,
    1,
    True,
    1.0,
    "1",
    b"1",
    2**70,
    float("inf"),
    1j,
    [],
    (),
    [1, 2],
    [2, 1],
    (1, 2),
    [[1], 2],
    [1, [2]],
    {},
    {"a": 1},
    {"a": 2},
    {"b": 1},
    {1: "a"},
    {1, 2},
    {1, 3},
    deque([1, 2]),
    deque([1, 2], 5),
    np.zeros(3),
    np.zeros(3, dtype=np.float32),
    np.zeros((3, 1)),
    np.array([0.0, 0.0, 1e-300]),
    np.array(["a"]),
    np.float64(1.0),
    np.float32(1.0),
    Path("a"),
    Color.RED,
    Color.BLUE,
    Gains(1.0),
    Gains(2.0),
    Limits(top=1.0),
    Limits(top=2.0),
    Memory([1]),
    Memory([2]),
    Gains,
    np.clip,
    np.sin,
    FrozenList([1]),
    FrozenList([2]),
    Place(1, 2),
    Place(2, 1),
    lambda: 1,
    lambda: 2,
    np.random.default_rng(1),
    np.random.default_rng(2),
]


def parameters(value: object) -> str:
    return object_fingerprint(Driver(value)).parameters


def test_values_of_another_type_or_content_have_another_digest():
    digests = [parameters(value) for value in DIFFERENT]
    assert len(set(digests)) == len(DIFFERENT)
    assert digests == [parameters(value) for value in DIFFERENT]


def test_order_counts_in_lists_and_not_in_dictionaries_and_sets():
    assert parameters({"a": 1, "b": {2, 30, 400}}) == parameters({"b": {400, 30, 2}, "a": 1})
    assert parameters(np.arange(6).reshape(2, 3).T) == parameters(np.ascontiguousarray(np.arange(6).reshape(2, 3).T))


def test_a_value_that_contains_itself_has_a_digest():
    one: list[object] = [1]
    one.append(one)
    other: list[object] = [2]
    other.append(other)
    assert parameters(one) != parameters(other)


def test_the_weights_and_settings_of_a_network_are_parameters():
    torch = pytest.importorskip("torch")

    def network(rate: float = 0.1) -> object:
        torch.manual_seed(0)
        return torch.nn.Sequential(torch.nn.Linear(2, 2), torch.nn.Dropout(rate)).eval()

    changed = network()
    with torch.no_grad():
        changed[0].weight[0, 0] += 1e-7
    training = network()
    training.train()
    digests = {parameters(value) for value in (network(), changed, network(0.2), training, torch.zeros(2))}
    assert len(digests) == 5
    assert parameters(network()) == parameters(network())
    assert parameters(torch.zeros(2)) != parameters(torch.zeros(2, dtype=torch.bfloat16))


@pytest.mark.parametrize(
    "value",
    [
        threading.Lock(),
        functools.partial(print),
        sys.stdout,
        iter([1]),
        types.SimpleNamespace(a=1),
        memoryview(b""),
    ],
)
def test_a_value_without_a_digest_is_refused_by_its_name(value):
    with pytest.raises(
        OptionError, match=r"policy 'Driver': attribute 'parameter'\.deep\[1\] is a .*`parameters`"
    ) as error:
        parameters({"deep": [0, value]})
    assert "\n" not in str(error.value)


def test_a_policy_may_name_its_parameters_itself():
    class Connected(Driver):
        def __init__(self, gain: float) -> None:
            self.gain, self.lock = gain, threading.Lock()

        def parameters(self):
            return {"gain": self.gain}

    assert object_fingerprint(Connected(1.0)) == object_fingerprint(Connected(1.0))
    assert object_fingerprint(Connected(1.0)) != object_fingerprint(Connected(2.0))


def test_attributes_and_closures_of_the_class_count():
    def with_gain(gain: float) -> Policy:
        class Local(Driver):
            limit = 1.0

            def act(self, observation):
                return np.full(2, gain)

        return Local()

    one, same, other = with_gain(1.0), with_gain(1.0), with_gain(2.0)
    assert object_fingerprint(one) == object_fingerprint(same)
    assert object_fingerprint(one) != object_fingerprint(other)
    type(same).limit = 2.0
    assert object_fingerprint(one) != object_fingerprint(same)


def test_files_count_by_content(tmp_path):
    class Weighted(Driver):
        def files(self):
            return (tmp_path / "weights",)

    (tmp_path / "weights").write_bytes(b"1")
    first = object_fingerprint(Weighted())
    (tmp_path / "weights").write_bytes(b"2")
    assert object_fingerprint(Weighted()).files != first.files
    (tmp_path / "weights").unlink()
    with pytest.raises(OptionError, match="weights cannot be read"):
        object_fingerprint(Weighted())


@pytest.mark.parametrize("name", ["astar", "dwa", "online_map", "random", "straight"])
def test_built_in_policies_have_a_fingerprint_that_tells_their_options(name):
    assert object_fingerprint(make_policy(name)) == object_fingerprint(make_policy(name))
    options = type(make_policy(name)).options_type
    if options is not None:
        assert issubclass(options, PolicyOptions)
        field = next(key for key, info in options.model_fields.items() if isinstance(info.default, float))
        other = make_policy(name, **{field: options.model_fields[field].default * 1.01})
        assert object_fingerprint(other).parameters != object_fingerprint(make_policy(name)).parameters


def write_modules(folder: Path, **files: str) -> None:
    """Write modules; the name `pkg_in_mod` stands for pkg/mod.py, `init` for __init__."""
    for name, text in files.items():
        path = folder / f"{name.replace('_in_', '/').replace('init', '__init__')}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def named(place: str, **options: object) -> str:
    return named_fingerprint("mine", place, options).model_dump_json()


def test_a_named_class_counts_by_its_module_and_what_it_imports_from_its_folder(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    files = {
        "drivers": "import numpy\ndef late():\n    import gains\nraise SystemExit('not to be imported')\n",
        "gains": "import gears.low as low\n",
        "gears_in_init": "",
        "gears_in_low": "LOW = 1\n",
        "unrelated": "",
    }
    write_modules(tmp_path, **files)
    first = named("drivers:Mine", gain=1)
    assert named("drivers:Mine", gain=1) == first
    write_modules(tmp_path, unrelated="A = 1\n", other="")
    assert named("drivers:Mine", gain=1) == first
    digests = {first, named("drivers:Mine", gain=2), named("drivers:Other", gain=1)}
    for name in ("drivers", "gains", "gears_in_init", "gears_in_low"):
        write_modules(tmp_path, **{name: f"{files[name]}# edited\n"})
        digests.add(named("drivers:Mine", gain=1))
    assert len(digests) == 7
    assert "drivers" not in sys.modules


def test_a_module_of_a_package_counts_with_the_package(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    write_modules(tmp_path, bots_in_init="", bots_in_main="from .parts import wheel\nfrom . import seat\n", beside="")
    write_modules(tmp_path, bots_in_parts_in_wheel="SIZE = 1\n", bots_in_seat="", bots_in_other="")
    first = named("bots.main:Mine")
    write_modules(tmp_path, bots_in_other="A = 1\n", beside="A = 1\n")
    assert named("bots.main:Mine") == first
    write_modules(tmp_path, bots_in_parts_in_wheel="SIZE = 2\n")
    second = named("bots.main:Mine")
    write_modules(tmp_path, bots_in_seat="A = 1\n")
    assert len({first, second, named("bots.main:Mine")}) == 3


def test_a_module_without_a_file_is_refused():
    with pytest.raises(OptionError, match="module 'builtins' has no source file"):
        named("builtins:object")


CELL = """
import numpy as np
from labgym.policies import Policy

GAIN = {gain}

def halved(value):
    return value / {divisor} * GAIN

class Base(Policy):
    def reset(self, episode):
        self.speed = {speed}

class Cell(Base):
    def act(self, observation):
        return np.full(2, halved(self.speed))
"""


def cell(monkeypatch, gain: float = 1.0, divisor: int = 2, speed: float = 0.5, shown: bool = True) -> Policy:
    return notebook_policy(monkeypatch, CELL.format(gain=gain, divisor=divisor, speed=speed), shown)


def test_an_edited_class_of_a_notebook_has_another_fingerprint(monkeypatch):
    first = object_fingerprint(cell(monkeypatch))
    assert object_fingerprint(cell(monkeypatch)) == first
    for change in ({"gain": 2.0}, {"divisor": 3}, {"speed": 0.6}):
        other = object_fingerprint(cell(monkeypatch, **change))
        assert other.source != first.source, change


def test_a_class_without_a_known_source_is_refused(monkeypatch):
    policy = cell(monkeypatch, shown=False)
    with pytest.raises(OptionError, match=r"source of class 'Cell' is not known.* put the class into a \.py file"):
        object_fingerprint(policy)


def test_a_class_typed_after_a_script_is_not_taken_for_one_of_the_script(monkeypatch, tmp_path):
    policy = cell(monkeypatch, shown=False)
    (tmp_path / "script.py").write_text("pass")
    sys.modules["__main__"].__file__ = str(tmp_path / "script.py")
    with pytest.raises(OptionError, match="source of class 'Cell' is not known"):
        object_fingerprint(policy)


SCRIPT = """
import json, sys
from labgym.policies.fingerprint.policy import named_fingerprint, object_fingerprint
import fingerprinted
policy = fingerprinted.Mine({"a": {"x", "y", "z"}, "b": fingerprinted.Gains(1.0)})
named = named_fingerprint("mine", "fingerprinted:Mine", {"b": 1, "a": [2]})
print(json.dumps([object_fingerprint(policy).model_dump(), named.model_dump()]))
"""


def test_fingerprints_are_equal_in_every_process(tmp_path):
    write_modules(
        tmp_path,
        fingerprinted="""
import dataclasses, types
import numpy as np
from labgym.policies import Policy

@dataclasses.dataclass
class Gains:
    forward: float

class Mine(Policy):
    names = frozenset({"p", "q", "r"})

    def __init__(self, options):
        self.options, self.array, self.rule = options, np.arange(3.0), lambda value: value

    def reset(self, episode): pass
    def act(self, observation): return np.zeros(2)
""",
    )
    root = Path(__file__).resolve().parents[2]
    outputs = []
    for seed in ("0", "1"):
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": f"{root}{os.pathsep}{tmp_path}"}
        command = [sys.executable, "-c", SCRIPT]
        outputs.append(subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout)
    assert outputs[0] == outputs[1]
    assert len(json.loads(outputs[0])) == 2
