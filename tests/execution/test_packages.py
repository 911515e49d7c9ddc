"""Packages that decide a result are found by import, with the versions that are installed."""

from importlib.metadata import version

import pytest

from pipeline.execution import packages
from pipeline.execution.packages import ABSENT, CALLED_BY, WITHOUT_EFFECT, package_versions
from stages.graph import MADE

DECIDING = {
    "objects": {"trimesh", "coacd", "manifold3d", "networkx"},
    "scenes": {"sapien", "python-fcl", "coacd"},
    "grasps": {"embreex", "qpsolvers", "piqp", "clarabel", "numba", "llvmlite"},
    "shards": {"numpy", "mcap", "protobuf", "zstandard"},
    "train": {"torch", "onnx", "openvino", "safetensors"},
    "evaluate": {"sapien", "openvino"},
    "sweep": {"torch"},
}


@pytest.mark.parametrize("stage", sorted(MADE))
def test_a_stages_packages_are_told_with_their_versions(stage: str) -> None:
    found = package_versions(MADE[stage].module)
    assert DECIDING[stage] <= found.keys()
    assert found == {name: version(name) for name in found}
    assert not found.keys() & WITHOUT_EFFECT


@pytest.mark.parametrize("stage", sorted(name for name, stage in MADE.items() if stage.drawn_apart))
def test_what_only_draws_is_no_part_of_an_artifact(stage: str) -> None:
    assert not {"rerun-sdk", "pyarrow"} & package_versions(MADE[stage].module).keys()


def test_an_upgrade_changes_what_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    before = package_versions("stages.shards")
    upgraded = {"numpy": "9.9.9"}
    monkeypatch.setattr(packages, "version", lambda name: upgraded.get(name) or version(name))
    after = package_versions("stages.shards")
    assert {name for name in before if before[name] != after[name]} == {"numpy"}


def test_what_is_not_installed_is_told_as_absent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packages, "foreign_imports", lambda *_: {"no_such_package.part"})
    assert package_versions("stages.shards") == {"no_such_package": ABSENT}


def test_what_others_call_is_installed_under_that_name() -> None:
    assert all(version(name) for called in CALLED_BY.values() for name in called)
