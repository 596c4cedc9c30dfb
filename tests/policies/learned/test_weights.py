"""Weights and checkpoints: what is written comes back, and files of anybody else's do no harm."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file
from torch import nn

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


def test_a_checkpoint_restores_network_optimizer_and_record(tmp_path: Path) -> None:
    first = network(1)
    optimizer = torch.optim.Adam(first.parameters(), lr=0.5)
    first(torch.ones(1, 3)).sum().backward()
    optimizer.step()
    save_checkpoint(tmp_path / "c.pt", {"network": first, "optimizer": optimizer}, {"epoch": 3, "losses": [0.5]})
    second = network(2)
    restored = torch.optim.Adam(second.parameters(), lr=0.1)
    record = load_checkpoint(tmp_path / "c.pt", {"network": second, "optimizer": restored})
    assert record == {"epoch": 3, "losses": [0.5]}
    assert torch.equal(first.weight, second.weight)
    assert restored.param_groups[0]["lr"] == 0.5


@pytest.mark.parametrize("content", [b"", b"torn", b"PK\x03\x04 half a zip"])
def test_a_damaged_checkpoint_is_named_with_the_remedy(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "c.pt").write_bytes(content)
    with pytest.raises(DocumentError, match=r"c\.pt: damaged, .* remove the folder"):
        load_checkpoint(tmp_path / "c.pt", {"network": network()})


def test_a_checkpoint_never_runs_code(tmp_path: Path) -> None:
    class Payload:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return os.mkdir, (str(tmp_path / "executed"),)

    torch.save({"parts": {}, "record": Payload()}, tmp_path / "c.pt")
    with pytest.raises(DocumentError):
        load_checkpoint(tmp_path / "c.pt", {})
    assert not (tmp_path / "executed").exists()
