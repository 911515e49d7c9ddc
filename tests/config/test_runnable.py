"""A configuration that is accepted can run: what its numbers size is built and used."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from pipeline.config import RunConfig, section_digest
from pipeline.config.section import Section
from pipeline.geometry.mesh import Mesh
from pipeline.labelling import label_mesh
from pipeline.network.ga_cnn import build_network, weighted_layer_count

FACTORS = (1e-3, 0.1, 0.5, 0.9, 1.1, 2.0, 10.0, 1e3)  # what a number of the defaults is changed by
NEVER_SET = "r_g_m"  # follows the pad


def number_fields(section: Section, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Where the tree has a field that is one number."""
    for name in type(section).model_fields:
        value = getattr(section, name)
        if isinstance(value, Section):
            yield from number_fields(value, (*path, name))
        elif isinstance(value, int | float) and not isinstance(value, bool) and name != NEVER_SET:
            yield (*path, name)


NUMBERS = tuple(number_fields(RunConfig()))
OF_THE_PAD = tuple(path for path in NUMBERS if path[0] == "gripper")


def value_at(config: RunConfig, path: tuple[str, ...]) -> Any:
    """The value of a field."""
    value: Any = config
    for name in path:
        value = getattr(value, name)
    return value


def changed(path: tuple[str, ...], factor: float) -> RunConfig | None:
    """The default tree with one number multiplied; None where that is refused."""
    return with_values({path: factor})


def with_values(factors: dict[tuple[str, ...], float]) -> RunConfig | None:
    """The default tree with some numbers multiplied; None where that is refused."""
    raw: dict[str, Any] = {}
    for path, factor in factors.items():
        old = value_at(RunConfig(), path)
        new = (type(old))((old or 1) * factor)
        table = raw
        for name in path[:-1]:
            table = table.setdefault(name, {})
        table[path[-1]] = new
    try:
        return RunConfig.model_validate(raw)
    except ValidationError:
        return None


@settings(max_examples=40, deadline=None)
@given(
    st.dictionaries(st.sampled_from(OF_THE_PAD), st.sampled_from(FACTORS), min_size=1, max_size=4)
)
def test_a_gripper_that_is_accepted_labels(factors: dict[tuple[str, ...], float]) -> None:
    """Numbers a thousandth to a thousandfold: q is in [0, 1], or the tree is refused."""
    config = with_values(factors)
    if config is None:
        return
    ball = trimesh.creation.icosphere(3, 2.4 * config.gripper.pad.radius_m)
    mesh = Mesh(np.array(ball.vertices), np.array(ball.faces, dtype=np.int64))
    on_top = np.eye(4)
    on_top[2, 3] = 2.4 * config.gripper.pad.radius_m
    quality = label_mesh(mesh, on_top[None], config).q
    assert ((quality >= 0) & (quality <= 1)).all()


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(NUMBERS), st.sampled_from(FACTORS))
def test_every_number_counts_in_its_sections_digest(path: tuple[str, ...], factor: float) -> None:
    """So that a stage is stale as soon as one of its numbers is another."""
    config = changed(path, factor)
    if config is None or value_at(config, path) == value_at(RunConfig(), path):
        return
    section = (path[0],)
    assert section_digest(config, section) != section_digest(RunConfig(), section)


@pytest.mark.parametrize("layers", range(16, 106))
def test_a_depth_that_is_accepted_is_built(layers: int) -> None:
    """Of the family of Supplement IV: all of it, and nothing between."""
    raw = {"network": {"layers": layers, "channels": (8, 16, 32, 64)}}
    if layers % 2 or not 18 <= layers <= 102:
        with pytest.raises(ValidationError):
            RunConfig.model_validate(raw)
    else:
        network = RunConfig.model_validate(raw).network
        assert weighted_layer_count(build_network(network, seed=0)) == layers
