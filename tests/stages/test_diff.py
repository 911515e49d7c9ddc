"""Two runs compared: nothing differs between a run and its copy, and what is changed is named."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from pipeline.config import load_run_config
from pipeline.control.success import Outcome
from pipeline.errors import ArtifactError, ConfigError
from pipeline.execution import RunFolder
from pipeline.reporting.two_runs import Clutter, Side, config_changes, object_changes, read_side
from pipeline.reporting.verdict import success_changes
from stages.diff import diff, identity
from stages.graph import STAGES


@pytest.fixture(scope="module")
def runs(run: RunFolder, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a run and its copy, compared."""
    folder = tmp_path_factory.mktemp("two")
    for name in ("a", "b"):
        shutil.copytree(run.path, folder / name)
    toml = folder / "b" / "run.toml"
    toml.write_text(toml.read_text().replace("count = 240", "count = 250"))
    diff("a", "b", folder)
    return folder


@pytest.fixture(scope="module")
def side(runs: Path) -> Side:
    return read_side(RunFolder(runs / "a"), tuple(STAGES))


def test_a_copy_differs_by_chance_alone(runs: Path) -> None:
    told = json.loads((runs / "a" / "diff-b" / "diff.summary.json").read_text())
    assert told["verdict"].startswith("Chance may explain: labels as a whole (p = 1)")
    assert "More than chance" not in told["verdict"]
    assert told["labels"]["all"] == {"distance": 0.0, "p": 1.0}
    assert told["objects"] == {"come": [], "gone": [], "changed": []}
    assert told["made_otherwise"] == {}
    assert told["configuration"] == {"grasps.count": ["240", "250"]}


def test_page_picture_and_recording_are_there(runs: Path) -> None:
    into = runs / "a" / "diff-b"
    assert "a and b compared" in (into / "diff.md").read_text()
    page = (into / "diff.html").read_text()
    assert "data:image/svg+xml" in page
    assert (into / "diff.rrd").stat().st_size > 0


def test_comparisons_of_the_same_objects_open_beside_each_other(side: Side) -> None:
    """The viewer shows recordings of one id as one, and so the two would lie over each other."""
    other = replace(side, folder=RunFolder(side.folder.path.parent / "b"))
    ids = [identity(side, other), identity(other, side), identity(side, side)]
    assert len(set(ids)) == len(ids)
    assert identity(side, other) == ids[0]


def test_errors_are_those_that_training_told(runs: Path, side: Side) -> None:
    told = json.loads((runs / "a" / "train.summary.json").read_text())
    assert set(side.error) <= {item.name for item in side.catalogue.objects if item.split == "test"}
    assert min(side.error.values()) - 1e-6 <= told["test_mae"] <= max(side.error.values()) + 1e-6


def test_objects_that_come_go_and_change_are_named(side: Side) -> None:
    names = sorted(side.content)
    other = dict(side.content)
    del other[names[0]]
    other[names[1]] = ("another", *other[names[1]][1:])
    other["mug"] = other[names[2]]
    found = object_changes(side, replace(side, content=other))
    assert (found.come, found.gone, found.changed) == (["mug"], [names[0]], [names[1]])


def test_success_is_paired_where_clutters_are_the_same_and_not_elsewhere(side: Side) -> None:
    same: dict[Clutter, Outcome] = {("s", (str(i),)): Outcome(1, 10) for i in range(8)}
    better = {clutter: Outcome(9, 10) for clutter in same}
    ours, theirs = (replace(side, outcomes={"closed-loop": o}) for o in (same, better))
    (paired,) = success_changes(ours, theirs)
    assert (paired.paired, paired.clutters) == (True, 8)
    assert paired.rates == pytest.approx((0.1, 0.9))
    assert paired.p < 0.01
    elsewhere: dict[Clutter, Outcome] = {("t", (str(i),)): Outcome(9, 10) for i in range(8)}
    (loose,) = success_changes(ours, replace(side, outcomes={"closed-loop": elsewhere}))
    assert not loose.paired
    assert loose.p < 1e-10


def test_configurations_are_compared_field_by_field(tmp_path: Path) -> None:
    configs = []
    for text in ("seed = 1", "seed = 2\n[train]\nepochs = 3"):
        (tmp_path / "run.toml").write_text(text)
        configs.append(load_run_config(tmp_path / "run.toml"))
    changes = {name: (a, b) for name, a, b in config_changes(*configs)}
    assert changes["seed"] == ("1", "2")
    assert changes["train.epochs"][1] == "3"
    assert len(changes) == 2


def test_a_run_without_objects_and_one_run_twice_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "run.toml").touch()
    with pytest.raises(ArtifactError, match=r"objects.mcap is missing.*make dataset RUN=a"):
        diff("a", "b", tmp_path)
    with pytest.raises(ConfigError, match="both a"):
        diff("a", "a", tmp_path)
