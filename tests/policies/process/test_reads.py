"""Every file that a policy reads belongs to its identity: those of loading count, others end the episode."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from labgym.errors import DocumentError, OptionError
from labgym.eval.driving.runner import policy_fingerprint
from labgym.eval.evaluator import evaluate
from labgym.layouts import load_published, published
from labgym.policies import EpisodeStart, make_policy
from labgym.policies.policy import PolicyError
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.suites import Suite

MODULE = """
import os, sys, json, importlib
from pathlib import Path
import cv2, numpy as np
from labgym.policies import Policy
HERE = Path(__file__).parent
class Mine(Policy):
    def __init__(self, **options):
        self.options = options
        {init}
    def reset(self, episode):
        {reset}
    def act(self, observation):
        {act}
        return np.zeros(2)
"""
READ_BY = {
    "numpy": ("self.table = np.load(HERE / ('ta' + 'ble.npy'))", "table.npy"),
    "python": ("self.text = open(os.path.join(HERE, 'deep', 'er', 'x' + '.txt')).read()", "deep/er/x.txt"),
    "a descriptor": ("self.n = os.read(os.open(str(HERE / ('b' + '.bin')), os.O_RDONLY), 9)", "b.bin"),
    "an option": ("self.text = open(self.options['path']).read()", "chosen.json"),
    "an option of a compiled library": ("self.p = cv2.imread(self.options['path'])", "chosen.png"),
    "a name in the source, by a compiled library": ("self.p = cv2.imread(str(HERE / 'goal.png'))", "goal.png"),
    "an import from elsewhere": (
        "sys.path.append(str(HERE / 'el' / 'se')); self.m = importlib.import_module('ot' + 'her')",
        "el/se/other.py",
    ),
}


def start() -> EpisodeStart:
    return EpisodeStart(goal=(3.0, 0.0), rng=np.random.default_rng(0))


def observation() -> dict[str, np.ndarray]:
    return {"goal": np.zeros(3, np.float32), "velocity": np.zeros(2, np.float32), "lidar": np.ones(180, np.float32)}


def filled(path: Path, value: int) -> None:
    """Write a file of its kind with one of several contents of equal size."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".npy":
        np.save(path, np.full(3, value))
    elif path.suffix == ".png":
        cv2.imwrite(str(path), np.full((4, 4, 3), value, np.uint8))
    else:
        path.write_text(f"A = {value}\n")


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    """Return a function that writes a policy with some code and returns its name."""
    monkeypatch.syspath_prepend(tmp_path)

    def write(name: str, init: str = "pass", reset: str = "pass", act: str = "pass") -> str:
        (tmp_path / f"{name}.py").write_text(MODULE.format(init=init, reset=reset, act=act))
        return f"{name}:Mine"

    return write


def identity(name: str, options: dict[str, object]) -> object:
    source = PolicySource.named(name, options)
    process = PolicyProcess(source)
    try:
        process.reset(start())
        process.act(observation())
        return policy_fingerprint(name, source, "mine", process.files())
    finally:
        process.close()


@pytest.mark.cases(4)
@pytest.mark.parametrize("way", READ_BY)
def test_a_file_that_is_read_at_load_counts_by_its_bytes(tmp_path: Path, module: Callable[..., str], way: str) -> None:
    code, place = READ_BY[way]
    name, file = module("reader", code), tmp_path / place
    options = {"path": str(file)} if "option" in way else {}
    seen = []
    for value in (1, 2, 1):
        filled(file, value)
        shutil.rmtree(tmp_path / "el/se/__pycache__", ignore_errors=True)
        seen.append(identity(name, options))
    assert seen[0] == seen[2] != seen[1]


def test_files_that_a_policy_makes_and_those_of_packages_do_not_count(
    tmp_path: Path, module: Callable[..., str]
) -> None:
    code = """import tempfile, matplotlib, encodings.utf_16, stat
        TMP = Path(tempfile.gettempdir())
        p = TMP / ('cac' + 'he')
        p.write_text(str(os.getpid()))
        p.read_text()
        t = tempfile.NamedTemporaryFile('w+', dir=TMP)
        open(t.name).read()
        w, done = TMP / 'w.tmp', TMP / ('do' + 'ne')
        w.write_text(str(os.getpid()))
        w.replace(done)
        done.read_text()
        for other in ('/proc/self/status', '/proc/cpuinfo', np.__file__):
            open(other).read()"""
    process = PolicyProcess(PolicySource.named(module("maker", code)))
    try:
        assert process.files() == ()
    finally:
        process.close()


@pytest.mark.parametrize("when", ["reset", "act"])
def test_a_file_that_is_read_while_driving_ends_the_episode_with_its_name(
    tmp_path: Path, module: Callable[..., str], when: str
) -> None:
    filled(tmp_path / "table.npy", 1)
    read = "np.load(HERE / ('ta' + 'ble.npy'))"
    process = PolicyProcess(PolicySource.named(module("late", **{when: read})))
    try:
        if when == "act":
            process.reset(start())
        with pytest.raises(PolicyError, match=r"table\.npy while driving.*files\(\)"):
            process.reset(start()) if when == "reset" else process.act(observation())
    finally:
        process.close()


def test_a_file_of_the_identity_may_be_read_while_driving(tmp_path: Path, module: Callable[..., str]) -> None:
    filled(tmp_path / "table.npy", 1)
    read = "np.load(HERE / ('ta' + 'ble.npy'))"
    name = module("again", init=read, reset=read, act=read)
    assert identity(name, {}) == identity(name, {})


def test_a_policy_that_reads_too_many_files_is_refused(tmp_path: Path, module: Callable[..., str]) -> None:
    for k in range(1100):
        (tmp_path / f"t{k}.txt").touch()
    name = module("many", "[open(HERE / f't{k}.txt').read() for k in range(1100)]")
    with pytest.raises(OptionError, match="pack them"):
        PolicyProcess(PolicySource.named(name))


def graph(path: Path, weight: float) -> None:
    """A graph whose weights are in w.bin, as torch.onnx.export writes them."""
    onnx = pytest.importorskip("onnx")
    helper, kind = onnx.helper, onnx.TensorProto
    weights = onnx.numpy_helper.from_array(np.full((3, 2), weight, np.float32), "weight")
    nodes = [
        helper.make_node("MatMul", ["goal", "weight"], ["hidden"]),
        helper.make_node("Tanh", ["hidden"], ["action"]),
    ]
    inputs = [helper.make_tensor_value_info("goal", kind.FLOAT, [1, 3])]
    outputs = [helper.make_tensor_value_info("action", kind.FLOAT, [1, 2])]
    content = helper.make_graph(nodes, "p", inputs, outputs, [weights])
    model = helper.make_model(content, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.save(model, path, save_as_external_data=True, location="w.bin", size_threshold=0)


def test_replaced_weights_of_a_graph_never_meet_its_old_rows(tmp_path: Path) -> None:
    pytest.importorskip("onnxruntime")
    layout = load_published("test", published("test")[0])
    suite = Suite(name="brief", split="test", max_steps=3).first([layout], 2)
    model, out = tmp_path / "m.onnx", tmp_path / "out"
    graph(model, 0.1)
    unchanged = model.read_bytes()
    first = evaluate(str(model), suite, out=out, progress=False)
    assert evaluate(str(model), suite, out=out, progress=False).rows == first.rows
    (tmp_path / "w.bin").unlink()
    graph(model, 0.9)
    assert model.read_bytes() == unchanged
    with pytest.raises(OptionError, match="holds another run"):
        evaluate(str(model), suite, out=out, progress=False)
    assert evaluate(str(model), suite, out=out, progress=False, fresh=True).routes != first.routes


OUTSIDE = ("../w.bin", "/etc/hostname", "no.bin", "link.bin", "*/_ORT_MEM_ADDR_/*", "a\0b", "")


@pytest.mark.parametrize("location", OUTSIDE)
def test_weights_outside_of_the_folder_are_refused(tmp_path: Path, location: str) -> None:
    onnx = pytest.importorskip("onnx")
    pytest.importorskip("onnxruntime")
    folder = tmp_path / "model"
    folder.mkdir()
    graph(folder / "m.onnx", 0.1)
    shutil.copy(folder / "w.bin", tmp_path / "w.bin")
    (folder / "link.bin").symlink_to(tmp_path / "w.bin")
    model = onnx.load(folder / "m.onnx", load_external_data=False)
    next(entry for entry in model.graph.initializer[0].external_data if entry.key == "location").value = location
    (folder / "m.onnx").write_bytes(model.SerializeToString())
    with pytest.raises(DocumentError, match="external_data") as caught:
        make_policy(str(folder / "m.onnx"))
    assert "\n" not in str(caught.value)


def test_workers_load_the_same_files(tmp_path: Path, module: Callable[..., str]) -> None:
    """Each worker compares the digest of the files that it loads with that of the evaluation."""
    filled(tmp_path / "table.npy", 1)
    name = module("shared", "self.table = np.load(HERE / ('ta' + 'ble.npy'))")
    layouts = tuple(load_published("test", layout).id for layout in published("test")[:2])
    suite = Suite(name="brief", split="test", layouts=layouts, max_steps=2)
    report = evaluate(name, suite, workers=2, out=tmp_path / "out", progress=False)
    assert report.summary.errors == 0
