"""Files of trained policies and of their training: weights, configurations, checkpoints, ONNX, TorchScript, SB3."""

from __future__ import annotations

import hashlib
import io
import json
import struct
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from fuzz.mutation import FLOATS, mutated_bytes, mutated_data, mutated_json, mutated_zip
from fuzz.target import Case, Target, one_file
from fuzz.targets.reactions import mutated_message
from labgym.errors import LabgymError

TORCH = ("torch", "labgym.policies.navdp.network", "labgym.policies.iplanner.network", "labgym.policies.ppo.policy")
SB3 = ("torch", "stable_baselines3")
PLACES = ("bias", "weight", "../weight", "/etc/passwd", "/dev/zero", "", ".", "a\0b", "*/_ORT_MEM_ADDR_/*", "x" * 5000)
"""Locations of weights."""
ZEROS = {
    "goal": np.zeros(3, np.float32),
    "velocity": np.zeros(2, np.float32),
    "odometry": np.zeros(3, np.float32),
    "lidar": np.zeros(180, np.float32),
    "depth": np.zeros(72 * 128, np.float32),
    "rgb": np.zeros((72, 128, 3), np.uint8),
}


def targets() -> Iterator[Target]:
    """Yield a target for each kind of file."""
    for name in ("navdp", "iplanner"):
        yield Target(f"weights {name}", partial(_weights, name), partial(_policy, name), TORCH, share=0.5)
    yield Target("weights ppo", partial(_weights, "ppo"), partial(_policy, "ppo"), TORCH)
    yield Target("checkpoint container", partial(_checkpoint, False), _resume, TORCH, share=0.5)
    yield Target("checkpoint content", partial(_checkpoint, True), _resume, TORCH, share=0.5)
    yield Target("onnx container", partial(_onnx, False), partial(_file, "a.onnx"), ("onnxruntime",), True, 0.5)
    yield Target("onnx graph", partial(_onnx, True), partial(_file, "a.onnx"), ("onnxruntime",), True, 0.5)
    yield Target("onnx with weights in other files", _onnx_apart, partial(_file, "a.onnx"), ("onnxruntime",), True, 0.5)
    yield Target("torchscript container", partial(_torchscript, False), partial(_file, "a.pt"), TORCH, True, 0.5)
    yield Target("torchscript members", partial(_torchscript, True), partial(_file, "a.pt"), TORCH, True, 0.5)
    yield Target("sb3 container", partial(_sb3, False), partial(_file, "a.zip"), SB3, True, 0.5)
    yield Target("sb3 members", partial(_sb3, True), partial(_file, "a.zip"), SB3, True, 0.5)
    yield Target("dataset container", partial(_dataset, False), _load_dataset, ("pyarrow.parquet",), share=0.5)
    yield Target("dataset content", partial(_dataset, True), _load_dataset, ("pyarrow.parquet",), share=0.5)


@cache
def _small(name: str) -> tuple[dict[str, Any], bytes]:
    """Return configuration and weights of a network that is small enough to be made 10 000 times."""
    import torch
    from safetensors.torch import save

    torch.manual_seed(0)
    if name == "navdp":
        from labgym.policies.navdp.config import NavDPConfig, NavDPNetworkOptions
        from labgym.policies.navdp.network import NavDPNetwork

        options = NavDPNetworkOptions(channels=(8, 8, 8), queries=2, width=8, heads=2, layers=1, points=4)
        config: Any = NavDPConfig(network=options)
        network: Any = NavDPNetwork(config)
    elif name == "iplanner":
        from labgym.policies.iplanner.config import IPlannerConfig, IPlannerNetworkOptions
        from labgym.policies.iplanner.network import IPlannerNetwork

        config = IPlannerConfig(network=IPlannerNetworkOptions(channels=(8, 8), goal_width=2))
        network = IPlannerNetwork(config.network)
    else:
        from labgym.policies.ppo.network import Actor
        from labgym.policies.ppo.options import PPOOptions

        config, network = PPOOptions(), Actor("lidar")
    return config.to_json(), save(dict(network.state_dict()))


def _weights(name: str) -> Callable[[Random | None], Case]:
    config, weights = _small(name)
    length = struct.unpack("<Q", weights[:8])[0]
    header, data = json.loads(weights[8 : 8 + length]), weights[8 + length :]

    def make(rng: Random | None) -> Case:
        text, content = json.dumps(config).encode(), weights
        if rng is not None and rng.random() < 0.35:
            text = mutated_json(rng, config)
        elif rng is not None and rng.random() < 0.3:
            content = mutated_bytes(rng, weights)
        elif rng is not None and rng.random() < 0.3:
            place = rng.randrange(0, len(data) - 4, 4)
            content = weights[: 8 + length] + data[:place] + rng.choice(FLOATS) + data[place + 4 :]
        elif rng is not None:
            head = json.dumps(mutated_data(rng, header)).encode("utf-8", "surrogatepass")
            content = struct.pack("<Q", len(head)) + head + data
        return {"config.json": text, "weights.safetensors": content}

    return make


def _policy(name: str, folder: Path) -> None:
    """Load weights as `labgym eval --options weights=FOLDER` does."""
    from labgym.policies import make_policy

    make_policy(name, weights=str(folder))


def _parts() -> dict[str, Any]:
    import torch

    torch.manual_seed(0)
    network = torch.nn.Sequential(torch.nn.Linear(3, 4), torch.nn.ReLU(), torch.nn.Linear(4, 2))
    optimizer = torch.optim.AdamW(network.parameters(), lr=1e-3)
    network(torch.ones(1, 3)).sum().backward()
    optimizer.step()
    schedule = torch.optim.lr_scheduler.ReduceLROnPlateau(optimizer, factor=0.3, patience=1)
    rates = torch.optim.lr_scheduler.LambdaLR(optimizer, lambda step: 1.0)
    return {"network": network, "optimizer": optimizer, "schedule": schedule, "rates": rates}


def _checkpoint(inside: bool) -> Callable[[Random | None], Case]:
    import torch

    from labgym.policies.learned.checkpoint import save_checkpoint

    path = Path("seed.pt").absolute()
    history = [{"epoch": 1, "rate": 1e-3, "train": {"total": 0.5}}]
    save_checkpoint(path, _parts(), history)
    content = path.read_bytes()

    def make(rng: Random | None) -> Case:
        if rng is None:
            return {"checkpoint.pt": content}
        if not inside:
            return {"checkpoint.pt": mutated_bytes(rng, content)}
        if rng.random() < 0.4:
            return {"checkpoint.pt": mutated_zip(rng, content)}
        state = {"parts": {name: part.state_dict() for name, part in _parts().items()}, "record": history}
        stream = io.BytesIO()
        torch.save(_changed_state(rng, state), stream)
        return {"checkpoint.pt": stream.getvalue()}

    return make


def _changed_state(rng: Random, state: Any) -> Any:
    """Return a state with an entry of another type, name or shape, at any depth."""
    import torch

    holders = list(_holders(state))
    holder = rng.choice(holders)
    key = rng.choice(list(holder) if isinstance(holder, dict) else range(len(holder)))
    value = holder[key]
    choices: list[Any] = [None, "x", -1, 10**12, float("nan"), [], {}, torch.zeros(0), torch.zeros(1, dtype=torch.int8)]
    if isinstance(value, torch.Tensor) and value.is_floating_point():
        choices += [value.double(), value[..., None], torch.full_like(value, float("inf")), value.to(torch.complex64)]
    if rng.random() < 0.15 and isinstance(holder, dict):
        del holder[key]
    elif rng.random() < 0.2 and isinstance(holder, dict):
        holder[rng.choice(("step", "__class__", 0, "x"))] = value
    else:
        holder[key] = rng.choice(choices)
    return state


def _holders(state: Any) -> Iterator[Any]:
    if isinstance(state, dict | list) and state:
        yield state
        for part in state.values() if isinstance(state, dict) else state:
            yield from _holders(part)


def _resume(folder: Path) -> None:
    """Resume a training from a checkpoint, and take a step."""
    import torch

    from labgym.policies.learned.checkpoint import load_checkpoint
    from labgym.policies.learned.training_loop import _is_history

    parts = _parts()
    load_checkpoint(folder / "checkpoint.pt", parts, _is_history)
    parts["network"](torch.ones(1, 3)).sum().backward()
    parts["schedule"].step(0.5)
    parts["rates"].step()


def _onnx(inside: bool) -> Callable[[Random | None], Case]:
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    nodes = [
        helper.make_node("Concat", ["goal", "velocity"], ["joined"], axis=1),
        helper.make_node("Gemm", ["joined", "weight", "bias"], ["hidden"], alpha=1.0, transB=1),
        helper.make_node("Tanh", ["hidden"], ["action"]),
    ]
    inputs = [helper.make_tensor_value_info(n, TensorProto.FLOAT, [1, s]) for n, s in (("goal", 3), ("velocity", 2))]
    outputs = [helper.make_tensor_value_info("action", TensorProto.FLOAT, [1, 2])]
    weights = [
        numpy_helper.from_array(np.ones((2, 5), np.float32), "weight"),
        numpy_helper.from_array(np.zeros(2, np.float32), "bias"),
    ]
    graph = helper.make_graph(nodes, "policy", inputs, outputs, weights)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.checker.check_model(model)
    return one_file("a.onnx", model.SerializeToString(), mutated_message if inside else mutated_bytes)


def _onnx_apart() -> Callable[[Random | None], Case]:
    """Return a maker of graphs whose weights are in two other files, one of which or the reference to it is changed."""
    import onnx

    path = Path("apart.onnx").absolute()
    model = onnx.load_model_from_string(_onnx(True)(None)["a.onnx"])
    onnx.save(model, path, save_as_external_data=True, all_tensors_to_one_file=False, size_threshold=0)
    graph = onnx.load(path, load_external_data=False)
    weights = {name: path.with_name(name).read_bytes() for name in ("weight", "bias")}

    def make(rng: Random | None) -> Case:
        content, files = graph.SerializeToString(), dict(weights)
        if rng is None:
            return {"a.onnx": content, **files}
        name = rng.choice(sorted(files))
        match rng.randrange(4):
            case 0:
                files[name] = mutated_bytes(rng, files[name])
            case 1:
                del files[name]
            case 2:
                changed = onnx.load_model_from_string(content)
                entries = rng.choice(changed.graph.initializer).external_data
                entry = rng.choice(entries)
                entry.value = rng.choice((*PLACES, "-1", str(2**40), str(2**63), "1e9", "x"))
                if rng.random() < 0.3:
                    entries.add(key=rng.choice(("location", "offset", "length", "checksum")), value=rng.choice(PLACES))
                content = changed.SerializeToString()
            case _:
                content = mutated_message(rng, content)
        return {"a.onnx": content, **files}

    return make


def _file(name: str, folder: Path) -> None:
    """Load a policy's file and drive a step with it, as the process does that labgym starts for a policy."""
    from labgym.policies import make_policy

    options = {} if name.endswith(".onnx") else {"trust": True}
    policy = make_policy(str(folder / name), **options)
    action = policy.act(ZEROS)
    if not (action.shape == (2,) and np.isfinite(action).all()):
        raise AssertionError(f"not an action: {action}")


def _torchscript(inside: bool) -> Callable[[Random | None], Case]:
    import torch

    class Policy(torch.nn.Module):
        def __init__(self) -> None:
            super().__init__()
            self.layer = torch.nn.Linear(3, 2)

        def forward(self, goal: torch.Tensor) -> torch.Tensor:
            return torch.tanh(self.layer(goal))

    stream = io.BytesIO()
    torch.jit.save(torch.jit.trace(Policy(), {"goal": torch.zeros(1, 3)}["goal"]), stream)
    return one_file("a.pt", stream.getvalue(), partial(mutated_zip, change=_changed_code) if inside else mutated_bytes)


def _changed_code(rng: Random, name: str, data: bytes) -> bytes:
    """Change the code of a module as text, so that it still parses now and then."""
    if name.endswith(".py"):
        from fuzz.mutation import mutated_text

        return mutated_text(rng, data.decode()).encode("utf-8", "surrogatepass")
    return mutated_bytes(rng, data)


def _sb3(inside: bool) -> Callable[[Random | None], Case]:
    import gymnasium as gym
    from stable_baselines3 import PPO

    class Still(gym.Env):  # type: ignore[type-arg]
        observation_space = gym.spaces.Dict(
            {"goal": gym.spaces.Box(-50, 50, (3,), np.float32), "velocity": gym.spaces.Box(-2, 2, (2,), np.float32)}
        )
        action_space = gym.spaces.Box(-1, 1, (2,), np.float32)

        def reset(self, *, seed: Any = None, options: Any = None) -> Any:
            return self.observation_space.sample(), {}

    buffer = io.BytesIO()
    network = {"net_arch": [4]}
    PPO("MultiInputPolicy", Still(), n_steps=2, batch_size=2, policy_kwargs=network, device="cpu").save(buffer)
    change = partial(mutated_zip, change=_changed_model) if inside else mutated_bytes
    return one_file("a.zip", buffer.getvalue(), change)


def _changed_model(rng: Random, name: str, data: bytes) -> bytes:
    """Change a member of a model but for its pickled parts, which may do anything when they are changed."""
    if name != "data":
        return mutated_zip(rng, data) if data[:2] == b"PK" else mutated_bytes(rng, data)
    entries = json.loads(data)
    plain = {key: value for key, value in entries.items() if not (isinstance(value, dict) and ":serialized:" in value)}
    pickled = {key: value for key, value in entries.items() if key not in plain}
    return json.dumps(pickled | mutated_data(rng, plain), default=str).encode("utf-8", "surrogatepass")


def _dataset(inside: bool) -> Callable[[Random | None], Case]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    from labgym.policies.data.columns import depth_png, jpeg, map_schema, sample_schema
    from labgym.policies.data.manifest import DataOptions, DatasetLayout, DatasetManifest, DatasetShard

    row = {
        "index": 0,
        "episode_index": 0,
        "frame_index": 0,
        "timestamp": 0.0,
        "map_index": 0,
        "kind": "start",
        "observation.images.rgb": {"bytes": jpeg(np.zeros((72, 128, 3), np.uint8)), "path": None},
        "observation.images.depth": {"bytes": depth_png(np.ones((72, 128), np.float32)), "path": None},
        "observation.state": [1.0, 2.0, 0.5],
        "observation.goal": [1.0, 0.0],
        "action": [0.5] * 128,
        "path_length": 1.0,
        "path_clearance": 0.4,
    }
    cells = np.zeros(12, np.float32)
    place = {"map_index": 0, "layout": "a", "hash": "0" * 64, "rows": 3, "columns": 4, "resolution": 0.05}
    tables = {
        "samples/00000.parquet": ([row] * 4, sample_schema()),
        "maps/00000.parquet": ([place | {"origin": [0.0, 0.0], "cost": cells, "distance": cells}], map_schema()),
    }
    layout = DatasetLayout(id="a", protocol="sub_01", room="bay", seed=1, hash="0" * 64)

    def written(table: Any) -> bytes:
        stream = io.BytesIO()
        pq.write_table(table, stream)
        return stream.getvalue()

    def manifest(files: dict[str, bytes]) -> bytes:
        digests = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
        document = DatasetManifest(
            options=DataOptions(samples=4, shard=4),
            versions={},
            columns={},
            map_columns={},
            complete=True,
            shards=(DatasetShard(index=0, samples=4, layouts=(layout,), files=digests),),
        )
        return json.dumps(document.to_json()).encode()

    seed = {name: written(pa.Table.from_pylist(rows, schema=schema)) for name, (rows, schema) in tables.items()}

    def make(rng: Random | None) -> Case:
        files = dict(seed)
        if rng is None:
            return {**files, "manifest.json": manifest(files)}
        if rng.random() < 0.15:
            return {**files, "manifest.json": mutated_json(rng, json.loads(manifest(files)))}
        name = rng.choice(list(files))
        if inside:
            table = pa.Table.from_pylist(*tables[name][:1], schema=tables[name][1])
            try:
                files[name] = written(_changed_table(rng, table))
            except (pa.ArrowException, ValueError, TypeError):
                files[name] = written(table.slice(1))
        else:
            files[name] = mutated_bytes(rng, files[name])
        return {**files, "manifest.json": manifest(files if rng.random() < 0.9 else seed)}

    return make


def _changed_table(rng: Random, table: Any) -> Any:
    """Return a table with a column missing, renamed, of another type, with nulls or hostile values, or other rows."""
    import pyarrow as pa

    index = rng.randrange(table.num_columns)
    field = table.schema.field(index)
    values = table.column(index).to_pylist()
    match rng.randrange(8):
        case 0:
            return table.remove_column(index)
        case 1:
            return table.rename_columns([name + "x" * (name == field.name) for name in table.column_names])
        case 2:
            return pa.concat_tables([table] * rng.choice((0, 2, 50))) if rng.random() < 0.9 else table.slice(0, 0)
        case 3:
            values[rng.randrange(len(values))] = None
            return table.set_column(index, field, pa.array(values, field.type))
        case 4:
            other = rng.choice(([1], ["x"], [None], [[1.0]], [[]], [b"x"], [{"a": 1}], [True], [1.5]))
            return table.set_column(index, field.name, pa.array(other * len(table)))
        case 5 if isinstance(values[0], dict):
            picture = mutated_bytes(rng, values[0]["bytes"])
            array = pa.array([{"bytes": picture, "path": None}] * len(table), field.type)
            return table.set_column(index, field, array)
        case 5 | 6 if isinstance(values[0], int | float):
            hostile = rng.choice((-1, 0, 2**40, 2**62, float("nan"), float("inf"), -1e30))
            return table.set_column(index, field, pa.array([hostile] * len(table)).cast(field.type))
        case _ if isinstance(values[0], list):
            hostile = rng.choice((float("nan"), float("inf"), 1e38, None))
            width = rng.choice((len(values[0]), len(values[0]), 0, 1, 1000))
            return table.set_column(index, field, pa.array([[hostile] * width] * len(table), field.type))
    return table.slice(1)


def _load_dataset(folder: Path) -> None:
    """Load a dataset as training does, pictures included."""
    from labgym.policies.data import load_dataset
    from labgym.policies.data.read import pictures

    dataset = load_dataset(folder)
    if len(list(pictures(folder, len(dataset)))) != len(dataset):
        raise LabgymError("fewer pictures than samples")
