"""What another run learns from is held against what this one holds out."""

from dataclasses import replace
from pathlib import Path

import pytest
import trimesh

from pipeline.errors import ConfigError
from pipeline.geometry.apart import check_apart
from pipeline.geometry.catalogue import CatalogueObject
from tests.bodies import catalogue_object

THRESHOLD = 0.038


@pytest.fixture(scope="module")
def ball(tmp_path_factory: pytest.TempPathFactory) -> CatalogueObject:
    return named("ball", trimesh.creation.icosphere(3, 0.05), tmp_path_factory.mktemp("ball"))


@pytest.fixture(scope="module")
def bar(tmp_path_factory: pytest.TempPathFactory) -> CatalogueObject:
    return named("bar", trimesh.creation.box((0.02, 0.02, 0.1)), tmp_path_factory.mktemp("bar"))


def named(name: str, shape: trimesh.Trimesh, cache: Path) -> CatalogueObject:
    item = catalogue_object(name, shape, cache)
    return replace(item, family=name, source_sha256=f"content of {name}")


def like(item: CatalogueObject, name: str) -> CatalogueObject:
    """The same shape in another file."""
    return replace(item, name=name, family=name, source_sha256=f"content of {name}")


def test_other_shapes_are_apart(ball: CatalogueObject, bar: CatalogueObject) -> None:
    check_apart([ball], {"bar": (bar, "train")}, THRESHOLD, "other", THRESHOLD)


@pytest.mark.parametrize("name", ["ball", "apple"])
def test_what_is_held_out_here_may_not_be_learnt_from_there(
    ball: CatalogueObject, name: str
) -> None:
    """The file itself, or another of the same shape."""
    there = like(ball, name)
    with pytest.raises(ConfigError, match=rf"Run other, .* from {name}, .* holds out ball"):
        check_apart([ball], {name: (there, "train")}, THRESHOLD, "other", THRESHOLD)


def test_a_declared_family_counts(ball: CatalogueObject, bar: CatalogueObject) -> None:
    with pytest.raises(ConfigError, match="of its family"):
        check_apart(
            [ball], {"bar": (replace(bar, family="ball"), "train")}, THRESHOLD, "other", THRESHOLD
        )


@pytest.mark.parametrize("split", ["val", "test"])
def test_what_both_hold_out_was_compared_there(ball: CatalogueObject, split: str) -> None:
    """That run left out by its own threshold what is like the ball: it is not asked again."""
    other = {"ball": (ball, split), "apple": (like(ball, "apple"), "train")}
    check_apart([ball], other, THRESHOLD, "other", THRESHOLD)


def test_a_run_that_calls_fewer_shapes_alike_is_compared_again(ball: CatalogueObject) -> None:
    other = {"ball": (ball, "test"), "apple": (like(ball, "apple"), "train")}
    with pytest.raises(ConfigError, match="learns from apple"):
        check_apart([ball], other, THRESHOLD, "other", threshold_there=THRESHOLD / 2)


def test_a_declared_family_counts_though_both_hold_it_out(
    ball: CatalogueObject, bar: CatalogueObject
) -> None:
    other = {"ball": (ball, "test"), "bar": (replace(bar, family="ball"), "train")}
    with pytest.raises(ConfigError, match="learns from bar"):
        check_apart([ball], other, THRESHOLD, "other", THRESHOLD)
