"""The family to compare, its cost in closed form, and which member is taken."""

import numpy as np
import pytest
from pydantic import ValidationError

from pipeline.config.learning import NetworkConfig, SweepConfig
from pipeline.network.family import (
    VARIANTS,
    choose_member,
    list_members,
    multiply_adds,
    seed_spread,
    standard_error,
)
from pipeline.network.ga_cnn import build_network
from pipeline.network.input_channels import CHANNELS

OF_RUN = NetworkConfig(layers=52, channels=(64, 128, 256, 512))


def test_the_published_comparison_has_over_50_networks_of_18_to_102_layers() -> None:
    family = list_members(SweepConfig(ablation_seeds=0, seeds=1), OF_RUN, seed=0)
    assert len(family) > 50
    assert len({m.name for m in family}) == len(family)
    depths = {m.network.layers for m in family}
    assert min(depths) == 18
    assert max(depths) == 102
    assert len({m.network.channels for m in family}) == 4
    assert OF_RUN in [m.network for m in family]


def test_a_quarter_of_the_family_of_all_depths_and_channels_is_trained_with_three_seeds() -> None:
    members = list_members(SweepConfig(ablation_seeds=0), OF_RUN, seed=7)
    family = [m for m in members if m.group == "family"]
    repeats = [m for m in members if m.group == "repeat"]
    assert len({m.name for m in members}) == len(members)
    repeated = {m.network for m in repeats}
    assert 4 * len(repeated) == len(family)
    assert repeated <= {m.network for m in family}
    assert sorted(m.seed for m in repeats) == [8] * len(repeated) + [9] * len(repeated)
    assert {n.channels for n in repeated} == set(SweepConfig().channels)
    assert {n.layers for n in repeated} == set(SweepConfig().depths)


def test_the_spread_of_seeds_is_pooled_within_networks_and_not_between_them() -> None:
    assert seed_spread([[0.05], [0.06]]) is None
    spread = seed_spread([[0.1, 0.1 + 2e-3], [0.9, 0.9 + 2e-3], [0.5]])
    assert spread is not None
    assert spread.degrees == 2
    assert spread.deviation == pytest.approx(2e-3 / np.sqrt(2))
    # 95 % of Student's t with two degrees of freedom lie within 4.303.
    assert spread.least_difference == pytest.approx(4.303 * 2e-3, rel=1e-3)


def test_equal_networks_seldom_differ_by_more_than_the_least_difference() -> None:
    rng = np.random.default_rng(0)
    found = []
    for _ in range(2000):
        spread = seed_spread(rng.normal(0.05, 1e-3, (4, 3)).tolist())
        assert spread is not None
        one, other = rng.normal(0.05, 1e-3, 2)
        found.append(abs(one - other) > spread.least_difference)
    assert 0.035 < np.mean(found) < 0.065


def test_ablation_leaves_out_one_part_at_a_time() -> None:
    config = SweepConfig(depths=(18,), channels=((8, 8, 8, 8),), ablation_seeds=2)
    ablation = [m for m in list_members(config, OF_RUN, seed=5) if m.group == "ablation"]
    assert [m.variant for m in ablation] == [*VARIANTS, *VARIANTS]
    assert [m.seed for m in ablation] == [5, 5, 5, 6, 6, 6]
    whole, no_attention, no_augmentation = ablation[:3]
    assert whole.network == no_augmentation.network == OF_RUN
    assert no_attention.network == OF_RUN.model_copy(update={"attention": "none"})
    assert [m.augment for m in ablation[:3]] == [True, True, False]


def test_a_depth_that_no_member_has_is_refused_before_any_training() -> None:
    with pytest.raises(ValidationError, match="19 is no depth of the GA-CNN family"):
        SweepConfig(depths=(18, 19))


def test_multiply_adds_are_those_of_the_layers_sizes() -> None:
    c = 16
    network = build_network(NetworkConfig(layers=18, channels=(c, c, c, c), attention="none"), 0)
    stem = 24 * 24 * len(CHANNELS) * (c // 2) * 9 + 12 * 12 * (c // 2) * c * 9
    # Blocks of 9 c and c weights a channel and cell; strides halve the map in the second and third
    # stage, whose shortcuts then project. 18 layers are 1, 2, 2, 2 blocks.
    block = (9 * c * c) + c * c
    cells = [144] + [36] * 2 + [9] * 2 + [9] * 2
    blocks = sum(block * n for n in cells) + c * c * (36 + 9)
    head = c * (c // 4) + c // 4
    assert multiply_adds(network, 24) == stem + blocks + head


def test_the_cheapest_within_one_standard_error_is_chosen() -> None:
    errors, spread = [0.10, 0.051, 0.050, 0.052], [0.01, 0.002, 0.0015, 0.002]
    assert choose_member(errors, spread, cost=[1, 5, 9, 7]) == 1
    assert choose_member(errors, [0.0] * 4, cost=[1, 5, 9, 7]) == 2
    assert choose_member(errors, [0.1] * 4, cost=[1, 5, 9, 7]) == 0


def test_standard_error_shrinks_with_the_root_of_the_count() -> None:
    errors = np.random.default_rng(0).random(400).astype(np.float32)
    assert standard_error(errors) == pytest.approx(errors.std() / 20, rel=1e-5)
