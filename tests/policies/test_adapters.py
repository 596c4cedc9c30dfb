from __future__ import annotations

import importlib
import math
import os
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest

from labgym.envs import LabPointNavEnv
from labgym.errors import LabgymError, OptionError, UnknownNameError
from labgym.eval.evaluator import evaluate
from labgym.layouts import load_published, published
from labgym.policies import EpisodeStart, Policy, make_policy
from labgym.policies.fingerprint.policy import object_fingerprint
from labgym.policies.registry import FILES, SERVER
from labgym.suites import Suite

torch = pytest.importorskip("torch")
onnx = pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")
stable_baselines3 = pytest.importorskip("stable_baselines3")

pytestmark = pytest.mark.filterwarnings("ignore:.*torch.jit.*:DeprecationWarning", "ignore:.*because trust is set")

LAYOUT = load_published("test", published("test")[0])


def observation() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(2)
    return {
        "goal": np.array([3.0, math.cos(0.3), math.sin(0.3)], np.float32),
        "velocity": np.array([0.4, -0.2], np.float32),
        "odometry": np.array([1.0, 2.0, 0.5]),
        "lidar": rng.uniform(0.3, 10.0, 180).astype(np.float32),
        "depth": rng.uniform(0.3, 10.0, 72 * 128).astype(np.float32),
        "rgb": rng.integers(0, 256, (72, 128, 3)).astype(np.uint8),
    }


def start() -> EpisodeStart:
    return EpisodeStart(goal=(3.0, 0.0), rng=np.random.default_rng(0))


class Steer(torch.nn.Module):
    """Slower near things, turned by the sine of the bearing."""

    def forward(self, goal: torch.Tensor, lidar: torch.Tensor) -> torch.Tensor:
        return torch.stack([lidar.min(dim=1).values / 10.0, goal[:, 2]], dim=1)


class Look(torch.nn.Module):
    """Means over the picture's left half and the far half of the colours."""

    def forward(self, depth: torch.Tensor, rgb: torch.Tensor, odometry: torch.Tensor) -> torch.Tensor:
        return torch.stack([depth[:, 0, :, :64].mean(dim=(1, 2)) / 10.0, rgb[:, 0].mean(dim=(1, 2))], dim=1)


def script(module: torch.nn.Module, path: Path) -> Path:
    torch.jit.save(torch.jit.script(module), str(path))
    return path


def graph(path: Path, distances: str = "lidar") -> Path:
    """The steering of `Steer` as an ONNX graph, made by hand."""
    helper, kind = onnx.helper, onnx.TensorProto.FLOAT
    nodes = [
        helper.make_node("ReduceMin", [distances], ["nearest"], keepdims=1),
        helper.make_node("Reshape", ["nearest", "one"], ["flat"]),
        helper.make_node("Mul", ["flat", "tenth"], ["forward"]),
        helper.make_node("Gather", ["goal", "two"], ["turn"], axis=1),
        helper.make_node("Concat", ["forward", "turn"], ["action"], axis=1),
    ]
    constants = [
        helper.make_tensor("one", onnx.TensorProto.INT64, [2], [1, 1]),
        helper.make_tensor("two", onnx.TensorProto.INT64, [1], [2]),
        helper.make_tensor("tenth", kind, [1], [0.1]),
    ]
    inputs = [
        helper.make_tensor_value_info("goal", kind, [1, 3]),
        helper.make_tensor_value_info(distances, kind, [1, 180]),
    ]
    outputs = [helper.make_tensor_value_info("action", kind, [1, 2])]
    graph = helper.make_graph(nodes, "steer", inputs, outputs, constants)
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9), str(path))
    return path


def expected() -> list[float]:
    inputs = observation()
    return [float(inputs["lidar"].min()) / 10.0, float(inputs["goal"][2])]


@pytest.mark.parametrize("place", sorted({*FILES.values(), SERVER}))
def test_an_adapter_declares_no_latency_and_leaves_stopping_to_the_evaluator(place):
    module, _, name = place.partition(":")
    kind = getattr(importlib.import_module(module), name)
    assert issubclass(kind, Policy)
    assert kind.latency == 0.0
    assert kind.stop is Policy.stop
    # A network with a memory keeps it on the way to the next goal.
    assert (kind.next_goal is Policy.next_goal) is (name != "ActorPolicy")
    assert kind.goal_kinds == ("point",)


def test_torchscript_gets_the_observations_that_its_arguments_name(tmp_path):
    policy = make_policy(str(script(Steer(), tmp_path / "steer.pt")), trust=True)
    assert policy.observation == "lidar"
    policy.reset(start())
    assert policy.act(observation()) == pytest.approx(expected(), abs=1e-6)


def test_torchscript_receives_images_channels_first_with_colors_in_0_to_1(tmp_path):
    policy = make_policy(str(script(Look(), tmp_path / "look.torchscript")), trust=True)
    assert policy.observation == "rgbd"
    inputs = observation()
    left = inputs["depth"].reshape(72, 128)[:, :64].mean() / 10.0
    red = inputs["rgb"][..., 0].mean() / 255.0
    assert policy.act(inputs) == pytest.approx([left, red], abs=1e-5)


def test_onnx_gets_the_observations_that_its_inputs_name(tmp_path):
    policy = make_policy(str(graph(tmp_path / "steer.onnx")))
    assert policy.observation == "lidar"
    policy.reset(start())
    assert policy.act(observation()) == pytest.approx(expected(), abs=1e-6)


def test_inputs_of_other_names_can_be_renamed(tmp_path):
    path = graph(tmp_path / "steer.onnx", distances="scan")
    with pytest.raises(UnknownNameError, match=r"'scan' not found.*available: depth, goal, lidar"):
        make_policy(str(path))
    policy = make_policy(str(path), inputs={"scan": "lidar"})
    assert policy.act(observation()) == pytest.approx(expected(), abs=1e-6)
    with pytest.raises(OptionError, match="no input 'sacn'"):
        make_policy(str(path), inputs={"sacn": "lidar"})


class Greedy(torch.nn.Module):
    def forward(self, lidar: torch.Tensor, depth: torch.Tensor) -> torch.Tensor:
        return lidar[:, :2] + depth[:, 0, 0, :2]


class Wordy(torch.nn.Module):
    def forward(self, goal: torch.Tensor) -> torch.Tensor:
        return goal


class Lost(torch.nn.Module):
    def forward(self, goal: torch.Tensor) -> torch.Tensor:
        return goal[:, :2] / 0.0


class Wild(torch.nn.Module):
    def forward(self, goal: torch.Tensor) -> torch.Tensor:
        return goal[:, :2] * 100.0


def test_a_network_that_needs_lidar_and_camera_is_refused(tmp_path):
    with pytest.raises(OptionError, match="lidar and camera"):
        make_policy(str(script(Greedy(), tmp_path / "greedy.pt")), trust=True)


@pytest.mark.parametrize("module", [Wordy, Lost])
def test_an_output_that_is_not_an_action_is_reported(tmp_path, module):
    with pytest.raises(LabgymError, match="two finite numbers"):
        make_policy(str(script(module(), tmp_path / "m.pt")), trust=True).act(observation())


def test_an_action_beyond_the_limits_is_clipped(tmp_path):
    policy = make_policy(str(script(Wild(), tmp_path / "m.pt")), trust=True)
    assert policy.act(observation()) == pytest.approx([1.0, 1.0])


class Trap:
    """Creates a file when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def __reduce__(self):
        return os.mkdir, (str(self._path),)


def traps(folder: Path, sprung: Path) -> dict[str, Path]:
    """Files with code to be run in them, of every kind that a policy may be in."""
    (folder / "plain.pt").write_bytes(pickle.dumps(Trap(sprung)))
    torch.save(Trap(sprung), folder / "checkpoint.pt")
    torch.save({"model": Trap(sprung)}, folder / "legacy.pt", _use_new_zipfile_serialization=False)
    (folder / "graph.onnx").write_bytes(pickle.dumps(Trap(sprung)))
    with zipfile.ZipFile(folder / "model.zip", "w") as archive:
        archive.writestr("data", pickle.dumps(Trap(sprung)))
    return {path.name: path for path in folder.iterdir()}


@pytest.mark.parametrize("name", ["plain.pt", "checkpoint.pt", "legacy.pt", "graph.onnx", "model.zip"])
def test_nothing_is_unpickled_silently(tmp_path, name):
    sprung, folder = tmp_path / "sprung", tmp_path / "files"
    folder.mkdir()
    with pytest.raises(LabgymError) as caught:
        make_policy(str(traps(folder, sprung)[name]))
    assert not sprung.exists()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["plain.pt", "checkpoint.pt", "legacy.pt"])
def test_a_pickled_checkpoint_is_refused_even_if_it_is_trusted(tmp_path, name):
    sprung, folder = tmp_path / "sprung", tmp_path / "files"
    folder.mkdir()
    with pytest.raises(LabgymError) as caught:
        make_policy(str(traps(folder, sprung)[name]), trust=True)
    assert not sprung.exists()
    assert "\n" not in str(caught.value)


class WritesWhenLoaded(torch.nn.Module):
    """Creates a file by `torch.from_file` when the archive is loaded."""

    def __init__(self, sprung: str) -> None:
        super().__init__()
        self.sprung = sprung

    @torch.jit.export
    def __getstate__(self):
        return (self.sprung, self.training)

    @torch.jit.export
    def __setstate__(self, state: tuple[str, bool]):
        self.sprung = state[0]
        self.training = state[1]
        self.training = bool(torch.from_file(self.sprung, True, 8).sum() > 1e30)

    def forward(self, goal: torch.Tensor) -> torch.Tensor:
        return goal[:, :2]


class WritesWhenDriving(torch.nn.Module):
    def __init__(self, sprung: str) -> None:
        super().__init__()
        self.sprung = sprung

    def forward(self, goal: torch.Tensor) -> torch.Tensor:
        return goal[:, :2] + torch.from_file(self.sprung, True, 8).sum()


class SavesWhenDriving(torch.nn.Module):
    def __init__(self, sprung: str) -> None:
        super().__init__()
        self.sprung = sprung

    def forward(self, goal: torch.Tensor) -> torch.Tensor:
        torch.save(goal, self.sprung)
        return goal[:, :2]


@pytest.mark.parametrize("kind", [WritesWhenLoaded, WritesWhenDriving, SavesWhenDriving])
@pytest.mark.parametrize("suffix", [".pt", ".torchscript"])
def test_a_torchscript_program_creates_no_file_at_load_or_act(tmp_path, kind, suffix):
    """Oracle: torch itself creates the file from the same archive, when it loads or calls the module."""
    sprung, path = tmp_path / "sprung", tmp_path / f"m{suffix}"
    script(kind(str(sprung)), path)
    sprung.unlink(missing_ok=True)
    for options in ({}, {"trust": False}, {"trust": True}):
        with pytest.raises(LabgymError, match="opens files" if options.get("trust") else "trust=true") as caught:
            make_policy(str(path), **options).act(observation())
        assert "\n" not in str(caught.value)
        assert not sprung.exists()
    torch.jit.load(str(path))(torch.zeros(1, 3))
    assert sprung.exists()


def test_both_kinds_of_files_that_act_are_refused_by_one_rule(tmp_path, trained):
    lines = []
    for path in (script(Steer(), tmp_path / "steer.pt"), trained):
        with pytest.raises(LabgymError, match=r"trust=true.*ONNX or safetensors") as caught:
            make_policy(str(path))
        lines.append(str(caught.value).partition("; ")[2])
    assert lines[0] == lines[1]


def bomb(path: Path, inner: int = 0) -> Path:
    """An archive of a megabyte that unpacks to a gigabyte, `inner` archives deep."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("code/x.py", "w") as member:
        for _ in range(1024):
            member.write(bytes(2**20))
    for _ in range(inner):
        content = path.read_bytes()
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("policy.pth", content)
    return path


@pytest.mark.cases(1)
@pytest.mark.parametrize(("name", "inner"), [("a.pt", 0), ("a.zip", 0), ("a.zip", 1)])
def test_an_archive_that_unpacks_to_too_much_is_refused_before_it_is_unpacked(tmp_path, name, inner):
    with pytest.raises(LabgymError, match="unpacks to 1073741824 bytes"):
        make_policy(str(bomb(tmp_path / name, inner)), trust=True)


@pytest.mark.parametrize("name", ["no.pt", "no.onnx", "no.zip", "folder.zip"])
def test_a_missing_file_is_named(tmp_path, name):
    (tmp_path / "folder.zip").mkdir()
    with pytest.raises(LabgymError, match=rf"{name}.*no such file"):
        make_policy(str(tmp_path / name))


@pytest.mark.parametrize("name", ["broken.pt", "broken.onnx", "broken.zip"])
def test_a_file_with_other_content_is_a_one_line_error(tmp_path, name):
    (tmp_path / name).write_bytes(b"nothing of the kind")
    with pytest.raises(LabgymError, match=name) as caught:
        make_policy(str(tmp_path / name), **({} if name.endswith("onnx") else {"trust": True}))
    assert "\n" not in str(caught.value)


@pytest.fixture(scope="module")
def trained(tmp_path_factory) -> Path:
    """A model of stable-baselines3 that has learned nothing yet."""
    path = tmp_path_factory.mktemp("sb3") / "model.zip"
    env = LabPointNavEnv(layout=LAYOUT)
    stable_baselines3.PPO("MultiInputPolicy", env, n_steps=8, batch_size=8, device="cpu", seed=1).save(path)
    env.close()
    return path


def test_a_foreign_model_is_refused_with_the_reason_until_it_is_trusted(trained):
    with pytest.raises(LabgymError, match=r"unpickles.*trust=true"):
        make_policy(str(trained))
    with pytest.warns(UserWarning, match="because trust is set"):
        make_policy(str(trained), trust=True)


def test_a_model_acts_as_stable_baselines3_does(trained):
    policy = make_policy(str(trained), trust=True)
    assert policy.observation == "lidar"
    inputs = observation()
    model = stable_baselines3.PPO.load(trained, device="cpu")
    expected, _ = model.predict({key: inputs[key] for key in ("goal", "velocity", "lidar")}, deterministic=True)
    policy.reset(start())
    assert policy.act(inputs) == pytest.approx(np.clip(expected, -1.0, 1.0))


def test_a_model_can_sample_its_actions_from_the_episodes_generator(trained):
    policy = make_policy(str(trained), trust=True, deterministic=False)
    torch.manual_seed(1)
    untouched = torch.rand(1)
    torch.manual_seed(1)
    drives = []
    for seed in (3, 3, 4):
        policy.reset(EpisodeStart(goal=(2.0, 0.0), rng=np.random.default_rng(seed)))
        drives.append([policy.act(observation()).tolist() for _ in range(4)])
    assert drives[0] == drives[1] != drives[2]
    assert len({tuple(action) for action in drives[0]}) > 1
    assert torch.equal(torch.rand(1), untouched)


def test_a_model_of_flat_observations_receives_them_in_gymnasiums_order(tmp_path):
    import gymnasium as gym

    env = gym.wrappers.FlattenObservation(LabPointNavEnv(layout=LAYOUT))
    model = stable_baselines3.PPO("MlpPolicy", env, n_steps=8, batch_size=8, device="cpu", seed=1)
    model.save(tmp_path / "flat.zip")
    inputs = observation()
    flat = gym.spaces.flatten(env.unwrapped.observation_space, inputs)
    env.close()
    policy = make_policy(str(tmp_path / "flat.zip"), trust=True)
    assert policy.act(inputs) == pytest.approx(np.clip(model.predict(flat, deterministic=True)[0], -1.0, 1.0))


def test_a_model_of_another_environment_is_refused(tmp_path):
    stable_baselines3.PPO("MlpPolicy", "Pendulum-v1", n_steps=8, batch_size=8, device="cpu").save(tmp_path / "p.zip")
    with pytest.raises(OptionError, match="expected a Box of shape"):
        make_policy(str(tmp_path / "p.zip"), trust=True)


def test_an_unknown_algorithm_is_named(trained):
    with pytest.raises(UnknownNameError, match="DQN"):
        make_policy(str(trained), algorithm="DQN", trust=True)


def test_the_fingerprint_of_a_model_counts_the_bytes_of_its_file(tmp_path):
    path, digests = graph(tmp_path / "steer.onnx"), set()
    for factor in (0.1, 0.2, 0.2):
        model = onnx.load(str(path))
        model.graph.initializer[2].CopyFrom(onnx.helper.make_tensor("tenth", onnx.TensorProto.FLOAT, [1], [factor]))
        onnx.save(model, str(path))
        digests.add(object_fingerprint(make_policy(str(path))).files)
    assert len(digests) == 2


def test_fingerprints_of_models_count_their_options(tmp_path, trained):
    path = graph(tmp_path / "steer.onnx")
    assert object_fingerprint(make_policy(str(path))) == object_fingerprint(make_policy(str(path)))
    sampled, mean = (make_policy(str(trained), trust=True, deterministic=flag) for flag in (False, True))
    assert object_fingerprint(sampled).parameters != object_fingerprint(mean).parameters


def test_a_file_drives_an_evaluation(tmp_path):
    report = evaluate(
        str(graph(tmp_path / "steer.onnx")),
        Suite(name="brief", split="test", layouts=(LAYOUT.id,), max_steps=5),
        progress=False,
    )
    assert report.summary.errors == 0
