"""`make folds` keeps what it has tested: what was stopped goes on at the next fold."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import stages.folds
from pipeline.config import RunConfig, load_run_config
from pipeline.config.judged import folds_config, holdout_config, judged_config
from pipeline.config.learning import NetworkConfig
from pipeline.config.written import as_toml
from pipeline.errors import ArtifactError, ConfigError
from pipeline.execution import RunFolder
from pipeline.messages.training import CHECKPOINT
from pipeline.network.by_object import ObjectError
from pipeline.network.checkpoint import save_checkpoint_bytes
from pipeline.network.folds import TestedFold
from pipeline.network.ga_cnn import build_network
from stages.folds import TESTED, fold_folder, measure, read_kept, runs_behind, starting


def fold_found(fold: int) -> TestedFold:
    q = np.array([0.25, 0.75], dtype=np.float32)
    error = ObjectError(f"mesh{fold}", 2, 0.5, 0.1 * fold, 0.1, None)
    facts = {"train": 4, "val": 2, "test": 2, "kept_epoch": 1, "val_mae": 0.1, "mae_single": 0.1}
    constant = {"median": 0.25}
    facts_of: dict[str, Any] = facts | {"baselines": constant, "baselines_as_proposed": constant}
    facts_of |= {"begun": {}}
    return TestedFold([error], q, q, q, facts_of)


def test_a_fold_that_was_tested_is_not_trained_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = RunFolder(tmp_path / "small" / "folds")
    for fold in range(3):
        fold_folder(folder, fold).path.mkdir(parents=True)
    folder.config.write_text("")
    trained: list[int] = []
    key = "first"

    def train(_: RunConfig, parts: object, fold: int, *others: object) -> TestedFold:
        trained.append(fold)
        if len(trained) == 2:
            raise KeyboardInterrupt
        return fold_found(fold)

    objects = {
        f"mesh{k}": (SimpleNamespace(family=f"family {k}", content=f"{k}"), "test")
        for k in range(3)
    }
    monkeypatch.setattr(stages.folds, "labelled", lambda folder: ((), None))
    monkeypatch.setattr(stages.folds, "read_objects", lambda path: objects)
    monkeypatch.setattr(stages.folds, "train_and_test", train)
    monkeypatch.setattr(stages.folds, "key_of", lambda folder, fold, folds, start: f"{key} {fold}")
    with pytest.raises(KeyboardInterrupt):
        measure("small", 3, tmp_path)
    assert not folder.summary("folds").exists()
    measure("small", 3, tmp_path)
    assert trained == [0, 1, 1, 2]
    first = folder.summary("folds").read_text()
    measure("small", 3, tmp_path)
    assert trained == [0, 1, 1, 2]
    assert without_time(folder.summary("folds").read_text()) == without_time(first)
    assert "median predictor 0.2500" in (folder.path / "folds.md").read_text()
    assert read_kept(fold_folder(folder, 1), "another key") is None
    assert (fold_folder(folder, 1).path / TESTED).is_file()


def without_time(text: str) -> list[str]:
    return [line for line in text.splitlines() if "wall_time_s" not in line]


def test_files_beside_the_runs_own_run_toml_are_found_from_within() -> None:
    config = RunConfig.model_validate(
        {"objects": {"masses": "masses.toml"}, "split": {"families": "../paper/families.toml"}}
    )
    dealt = folds_config(config, folds=5)
    assert dealt.objects.masses == "../masses.toml"
    assert dealt.split.families == "../../paper/families.toml"
    # The meshes of a holdout are others.
    assert holdout_config(config).objects.masses == ""


@pytest.mark.parametrize("within", [partial(folds_config, folds=5), holdout_config, judged_config])
def test_a_run_that_trains_on_no_mesh_has_runs_within_it(
    within: Callable[[RunConfig], RunConfig], tmp_path: Path
) -> None:
    solids = {"objects": {"random_solids": 9}, "split": {"meshes_in_training": False}}
    path = tmp_path / "run.toml"
    path.write_text(as_toml(within(RunConfig.model_validate(solids))))
    # Of their meshes alone.
    assert load_run_config(path).objects.random_solids == 0


def test_folds_begin_with_a_run_that_held_out_the_meshes_and_with_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = RunConfig.model_validate({"folds": {"start": "solids"}})
    own = {"mug": "a"}
    known: dict[str, Any] = {"cup": (SimpleNamespace(content="a"), "train")}
    monkeypatch.setattr(stages.folds, "read_objects", lambda path: known)
    with pytest.raises(ConfigError, match="has not held out mug"):
        starting(config, own, tmp_path)
    known["cup"] = (known["cup"][0], "test")
    with pytest.raises(ArtifactError, match=r"is missing, and folds\.start names"):
        starting(config, own, tmp_path)
    network = build_network(config.network, 3)
    path = tmp_path / "solids" / "train" / CHECKPOINT
    path.parent.mkdir(parents=True)
    path.write_bytes(save_checkpoint_bytes(network))
    started = starting(config, own, tmp_path)
    assert started is not None
    assert save_checkpoint_bytes(started) == path.read_bytes()
    assert starting(RunConfig(), own, tmp_path) is None
    deeper = NetworkConfig(layers=20)
    trained_on = config.model_copy(update={"network": deeper})
    started = starting(trained_on, own, tmp_path)
    assert started is not None
    assert started.config == deeper
    as_it_is = trained_on.folds.model_copy(update={"trained": False})
    with pytest.raises(ConfigError, match=r"has 18 layers .* wants 20"):
        starting(trained_on.model_copy(update={"folds": as_it_is}), own, tmp_path)


def test_what_a_start_began_with_must_have_held_out_the_meshes_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = RunConfig.model_validate({"folds": {"start": "further"}})
    for name, begun in (("further", "../solids"), ("solids", "../further"), ("lone", "released")):
        path = tmp_path / name
        (path / "train").mkdir(parents=True)
        (path / "train" / CHECKPOINT).write_bytes(
            save_checkpoint_bytes(build_network(config.folds.network, 3))
        )
        start = begun if begun == "released" else f"{begun}/train/{CHECKPOINT}"
        (path / "run.toml").write_text(f'[train]\nstart = "{start}"\n')
        (path / "objects.mcap").touch()
    held_out = {"further": "test", "solids": "train"}

    def known(path: Path) -> dict[str, Any]:
        return {"mug": (SimpleNamespace(content="a"), held_out[path.parent.name])}

    monkeypatch.setattr(stages.folds, "read_objects", known)
    with pytest.raises(ConfigError, match=r"Run solids, .* has not held out mug"):
        starting(config, {"mug": "a"}, tmp_path)
    held_out["solids"] = "val"
    wanted = config.model_copy(update={"network": config.folds.network})
    assert starting(wanted, {"mug": "a"}, tmp_path) is not None
    with pytest.raises(ConfigError, match="lone learned from released, and which objects that"):
        runs_behind(RunFolder(tmp_path / "lone"))


def test_what_a_start_learned_from_beside_must_have_held_out_the_meshes_too(tmp_path: Path) -> None:
    for name in ("solids", "more"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "objects.mcap").touch()
    (tmp_path / "more" / "run.toml").write_text('[train]\nstart = "released"\n')  # not its samples
    for name, further in (("last", '["../solids", "../more"]'), ("lost", '["../none"]')):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run.toml").write_text(f"[train]\nfurther_runs = {further}\n")
    found = {run.path.resolve().name for run in runs_behind(RunFolder(tmp_path / "last"))}
    assert found == {"last", "solids", "more"}
    with pytest.raises(ConfigError, match=r"lost learned from \.\./none, and which objects"):
        runs_behind(RunFolder(tmp_path / "lost"))


def test_a_run_that_is_a_start_too_is_followed_back(tmp_path: Path) -> None:
    starts = {"first": "", "second": "../first/train/w", "last": "../second/train/w"}
    for name, start in starts.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "objects.mcap").touch()
        further = '["../second"]' if name == "last" else "[]"
        (tmp_path / name / "run.toml").write_text(
            f'[train]\nstart = "{start}"\nfurther_runs = {further}\n'
        )
    found = {run.path.resolve().name for run in runs_behind(RunFolder(tmp_path / "last"))}
    assert found == {"last", "second", "first"}


def test_a_teachers_runs_are_followed_back_too(tmp_path: Path) -> None:
    """What a teacher learned from, its student knows."""
    named = {
        "first": "",
        "taught_by": '[train]\nstart = "../first/train/w"\n',
        "last": '[train]\nteachers = ["../taught_by/train/w"]\n',
        "unknown": '[train]\nteachers = ["released"]\n',
    }
    for name, told in named.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "objects.mcap").touch()
        (tmp_path / name / "run.toml").write_text(told)
    found = {run.path.resolve().name for run in runs_behind(RunFolder(tmp_path / "last"))}
    assert found == {"last", "taught_by", "first"}
    with pytest.raises(ConfigError, match="unknown learned from released, and which objects"):
        runs_behind(RunFolder(tmp_path / "unknown"))
