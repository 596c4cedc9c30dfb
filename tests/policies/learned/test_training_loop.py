from __future__ import annotations

import numpy as np
import torch

from labgym.policies.learned.map_stack import rotated, to_world
from labgym.policies.learned.training_loop import seeded, split_by_layout


def test_held_out_samples_share_no_layout_with_the_others() -> None:
    place = torch.tensor([0, 0, 1, 2, 3, 3, 4])
    trained, held_out = split_by_layout(place, 5, 0.4)
    assert trained.tolist() == [0, 1, 2, 3]
    assert held_out.tolist() == [4, 5, 6]
    assert len(split_by_layout(place, 5, 0.0)[1]) == 0


def test_initial_weights_depend_on_the_seed_and_leave_the_global_generator_alone() -> None:
    torch.manual_seed(5)
    expected = torch.rand(3)
    torch.manual_seed(5)
    first, second = (seeded(lambda: torch.nn.Linear(2, 2), 1) for _ in range(2))
    assert torch.equal(first.weight, second.weight)
    assert torch.equal(torch.rand(3), expected)


def test_batches_are_transformed_as_numpy_transforms_one_frame() -> None:
    from labgym.geometry import to_world as reference

    rng = np.random.default_rng(0)
    points, poses = rng.normal(size=(4, 5, 2)), rng.normal(size=(4, 3))
    batch = to_world(torch.from_numpy(points), torch.from_numpy(poses))
    for k in range(4):
        np.testing.assert_allclose(batch[k].numpy(), reference(points[k], poses[k]), atol=1e-12)
    turned = rotated(torch.from_numpy(points), torch.from_numpy(poses[:, 2]))
    for k in range(4):
        np.testing.assert_allclose(turned[k].numpy(), reference(points[k], (0.0, 0.0, poses[k, 2])), atol=1e-12)
