"""Weights and checkpoints: what is written comes back, and files of anybody else's do no harm."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file
from torch import nn

from labgym.artefacts import artefacts
from labgym.errors import DocumentError
from labgym.policies import make_policy
from labgym.policies.learned.checkpoint import load_checkpoint, save_checkpoint
from labgym.policies.learned.weights import WEIGHTS, load_weights, save_weights


def network(seed: int = 0) -> nn.Linear:
    torch.manual_seed(seed)
    return nn.Linear(3, 2)


def test_weights_come_back(tmp_path: Path) -> None:
    save_weights(network(1), tmp_path)
    assert torch.equal(load_weights(network(2), tmp_path).weight, network(1).weight)


def test_a_missing_file_is_named_with_the_command_that_writes_it(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match=r"weights\.safetensors: no such file; `labgym train`"):
        load_weights(network(), tmp_path)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_weights_that_are_not_finite_are_refused(tmp_path: Path, value: float) -> None:
    save_file({"weight": torch.zeros(2, 3), "bias": torch.tensor([0.0, value])}, tmp_path / WEIGHTS)
    with pytest.raises(DocumentError, match="bias: holds NaN or infinite weights"):
        load_weights(network(), tmp_path)


@pytest.mark.parametrize("content", [b"", b"\x80\x04\x95pickle", b"\xff" * 64])
def test_files_of_another_format_are_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / WEIGHTS).write_bytes(content)
    with pytest.raises(DocumentError, match="not the weights of this network"):
        load_weights(network(), tmp_path)


def test_weights_of_another_network_are_refused(tmp_path: Path) -> None:
    save_weights(nn.Linear(4, 2), tmp_path)
    with pytest.raises(DocumentError, match="not the weights of this network"):
        load_weights(network(), tmp_path)


@pytest.mark.parametrize("name", ["iplanner", "navdp", "ppo"])
def test_every_trained_policy_refuses_weights_that_are_not_finite(tmp_path: Path, name: str) -> None:
    for path in make_policy(name).files():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    from safetensors.torch import load_file

    tensors = load_file(tmp_path / WEIGHTS)
    save_file({key: torch.full_like(tensor, float("nan")) for key, tensor in tensors.items()}, tmp_path / WEIGHTS)
    with pytest.raises(DocumentError, match="NaN"):
        make_policy(name, weights=str(tmp_path))


def is_any(record: object) -> bool:
    return True


def test_a_checkpoint_restores_network_optimizer_and_record(tmp_path: Path) -> None:
    first = network(1)
    optimizer = torch.optim.Adam(first.parameters(), lr=0.5)
    first(torch.ones(1, 3)).sum().backward()
    optimizer.step()
    save_checkpoint(tmp_path / "c.pt", {"network": first, "optimizer": optimizer}, {"epoch": 3, "losses": [0.5]})
    second = network(2)
    restored = torch.optim.Adam(second.parameters(), lr=0.1)
    record = load_checkpoint(tmp_path / "c.pt", {"network": second, "optimizer": restored}, is_any)
    assert record == {"epoch": 3, "losses": [0.5]}
    assert torch.equal(first.weight, second.weight)
    assert restored.param_groups[0]["lr"] == 0.5


@pytest.mark.parametrize("content", [b"", b"torn", b"PK\x03\x04 half a zip"])
def test_a_damaged_checkpoint_is_named_with_the_remedy(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "c.pt").write_bytes(content)
    with pytest.raises(DocumentError, match=r"c\.pt: damaged, .* with --fresh"):
        load_checkpoint(tmp_path / "c.pt", {"network": network()}, is_any)


def test_a_checkpoint_never_runs_code(tmp_path: Path) -> None:
    class Payload:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return os.mkdir, (str(tmp_path / "executed"),)

    torch.save({"parts": {}, "record": Payload()}, tmp_path / "c.pt")
    with pytest.raises(DocumentError):
        load_checkpoint(tmp_path / "c.pt", {}, is_any)
    assert not (tmp_path / "executed").exists()


def schedule_of(first: torch.nn.Module) -> torch.optim.lr_scheduler.ReduceLROnPlateau:
    return torch.optim.lr_scheduler.ReduceLROnPlateau(torch.optim.Adam(first.parameters()), patience=1)


@pytest.mark.parametrize(
    "change",
    [
        {"step": 3},  # would replace a method of the schedule
        {"patience": "x"},
        {"patience": None, "factor": torch.ones(2)},
    ],
)
def test_a_schedule_of_other_entries_or_types_is_refused(tmp_path: Path, change: dict[str, object]) -> None:
    schedule = schedule_of(network())
    state = {**schedule.state_dict(), **change}
    torch.save({"parts": {"schedule": state}, "record": []}, tmp_path / "c.pt")
    with pytest.raises(DocumentError, match="damaged"):
        load_checkpoint(tmp_path / "c.pt", {"schedule": schedule}, is_any)
    save_checkpoint(tmp_path / "c.pt", {"schedule": schedule}, [])
    assert load_checkpoint(tmp_path / "c.pt", {"schedule": schedule_of(network())}, is_any) == []


def test_a_checkpoint_of_nan_or_of_another_record_is_refused(tmp_path: Path) -> None:
    broken = network()
    torch.nn.init.constant_(broken.weight, float("nan"))
    save_checkpoint(tmp_path / "c.pt", {"network": broken}, 5)
    with pytest.raises(DocumentError, match="NaN"):
        load_checkpoint(tmp_path / "c.pt", {"network": network()}, is_any)
    with pytest.raises(DocumentError, match="its record is not one of this training"):
        load_checkpoint(tmp_path / "c.pt", {"network": network()}, lambda record: isinstance(record, list))


@pytest.mark.parametrize(
    ("name", "option", "value"),
    [
        ("navdp", "layers", 10**6),
        ("navdp", "width", 4096),
        ("navdp", "width", 10**12),
        ("navdp", "width", 95),
        ("iplanner", "channels", [4096] * 5),
    ],
)
def test_a_configuration_of_a_giant_network_is_refused_before_it_is_built(
    tmp_path: Path, name: str, option: str, value: object
) -> None:
    config = json.loads((artefacts("policies") / name / "config.json").read_text())
    config["network"][option] = value
    (tmp_path / "config.json").write_text(json.dumps(config))
    shutil.copy(artefacts("policies") / name / WEIGHTS, tmp_path)
    with pytest.raises(DocumentError, match=r"config\.json: field network"):
        make_policy(name, weights=str(tmp_path))
