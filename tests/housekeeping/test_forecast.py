"""A forecast is what an earlier run took, times the ratio of their work."""

import json
from pathlib import Path
from typing import Any

import pytest

from pipeline.artifacts import Input
from pipeline.config import RunConfig, load_run_config
from pipeline.housekeeping.forecast import (
    Forecast,
    as_lines,
    duration_in_words,
    forecast,
    work_done,
    work_of,
)
from tests.housekeeping.conftest import make_run, make_stage

TOML = """
[scenes]
levels = [1, 3]
[scenes.clutters_per_level]
train = 3
val = 1
test = 2
[grasps]
count = 5000
[network]
layers = 18
[train]
epochs = 4
[evaluate]
policies = ["closed-loop", "open-loop"]
"""


@pytest.fixture
def config(tmp_path: Path) -> RunConfig:
    return load_run_config(make_run(tmp_path / "wanted", TOML).config)


def test_work_follows_the_configuration(config: RunConfig) -> None:
    assert work_of("objects", config, sources=20) == 20
    assert work_of("scenes", config, 20) == 2 * (3 + 1 + 2)
    assert work_of("grasps", config, 20) == work_of("shards", config, 20) == 5000
    assert work_of("train", config, 20) == 20_000
    assert work_of("train", config, 20, further=[config, config]) == 60_000
    assert work_of("shards", config, 20, further=[config]) == 5000
    curve = 2 * 1 * 2 * 3  # two policies at one clutter a level, at three scales
    assert work_of("evaluate", config, 20) == 2 * 2 * 2 + curve


def test_work_done_is_in_the_same_units() -> None:
    assert work_done("scenes", {"scenes": 12}) == 12
    assert work_done("shards", {"samples": {"train": 40, "val": {"a": 5, "b": 5}}}) == 50
    assert work_done("train", {"samples": {"train": 40, "val": 10}, "epochs": 3}) == 150
    assert work_done("evaluate", {"policies": {"a": {"clutters": 4}, "b": {"clutters": 4}}}) == 8
    at_scales = {"a": {"0": {"clutters": 2}, "2": {"clutters": 2}}}
    assert work_done("evaluate", {"policies": {}, "imperfection": at_scales}) == 4
    assert work_done("evaluate", {}) == 0


def test_time_and_disk_are_scaled_from_the_run_of_most_equal_work(
    tmp_path: Path, config: RunConfig
) -> None:
    small, large = make_run(tmp_path / "small"), make_run(tmp_path / "large")
    make_stage(small, "grasps", grasps=100, wall_time_s=8.0)
    make_stage(large, "grasps", grasps=10_000, wall_time_s=60.0)
    large.shards("grasps").mkdir()
    (large.shards("grasps") / "0.mcap").write_bytes(b"x" * 40_000)
    found = forecast("grasps", "never made", config, 20, [small, large])
    own = large.artifact("grasps").stat().st_size
    assert found == Forecast("grasps", "never made", 30.0, (40_000 + own) / 2, "large")


def test_what_is_taken_over_takes_no_time(tmp_path: Path, config: RunConfig) -> None:
    folder = make_run(tmp_path / "grown")
    make_stage(folder, "grasps", grasps=4000, taken_over=3, made=1, wall_time_s=10.0)
    found = forecast("grasps", "input changed", config, 20, [folder], kept=3000.0)
    assert found.wall_time_s == pytest.approx(20.0)  # 2000 to make, as 1000 took 10 s
    assert found.size_bytes == pytest.approx(folder.artifact("grasps").stat().st_size * 5 / 4)
    assert found.reason == "input changed; 3000 of 5000 grasps are taken over"
    make_stage(folder, "grasps", grasps=4000, taken_over=4, made=0, wall_time_s=0.1)
    assert forecast("grasps", "x", config, 20, [folder]) == Forecast("grasps", "x")


def test_another_network_tells_nothing_of_training(tmp_path: Path, config: RunConfig) -> None:
    folder = make_run(tmp_path / "other")
    like: dict[str, Any] = {"samples": {"train": 5000}, "epochs": 4, "wall_time_s": 120.0}
    make_stage(folder, "train", layers=52, channels=list(config.network.channels), **like)
    assert forecast("train", "x", config, 20, [folder]) == Forecast("train", "x")
    make_stage(folder, "train", layers=18, channels=list(config.network.channels), **like)
    assert forecast("train", "x", config, 20, [folder]).wall_time_s == pytest.approx(120.0)


def test_scans_are_told_by_scans_and_by_the_run_that_had_to_cut_them(
    tmp_path: Path, config: RunConfig
) -> None:
    """Embedded objects are cut in no time, and parts that are kept beside all runs in none."""
    runs = {name: make_run(tmp_path / name) for name in ("embedded", "cut", "found")}
    scan = (Input("meshes/mug.ply", "0" * 64),)
    make_stage(runs["embedded"], "objects", objects=20, wall_time_s=4.0)
    others = list(runs.values())
    unknown = forecast("objects", "x", config, 20, others[:1], scans=True)
    assert unknown == Forecast("objects", "x")
    make_stage(runs["cut"], "objects", scan, objects=10, wall_time_s=60.0)
    make_stage(runs["found"], "objects", scan, objects=20, wall_time_s=5.0)
    found = forecast("objects", "x", config, 20, others, scans=True)
    assert found.wall_time_s == pytest.approx(120.0)
    assert found.told_by == "cut"
    found = forecast("objects", "x", config, 20, others)
    assert found.wall_time_s == pytest.approx(4.0)
    assert found.told_by == "embedded"


def test_a_summary_without_its_artifact_tells_nothing(tmp_path: Path, config: RunConfig) -> None:
    folder = make_run(tmp_path / "gone")
    folder.summary("scenes").write_text(json.dumps({"scenes": 12, "wall_time_s": 3.0}))
    assert forecast("scenes", "x", config, 20, [folder]) == Forecast("scenes", "x")


def test_the_lines_sum_up_and_say_what_is_not_known() -> None:
    known = Forecast("scenes", "never made", 90.0, 2e6, "ci")
    lines = as_lines([known, Forecast("train", "after scenes")], free_bytes=10**9)
    assert "90 s" in lines[1]
    assert "run ci" in lines[1]
    assert "not known" in lines[2]
    assert lines[-1] == "in all at least about 90 s and 2 MB; 1 GB of disk are free"


def test_a_disk_too_small_is_told_before_it_begins() -> None:
    lines = as_lines([Forecast("scenes", "never made", 90.0, 2e9, "ci")], free_bytes=10**9)
    assert "too small" in lines[-1]


def test_nothing_to_make_is_one_line() -> None:
    assert as_lines([], 1) == ["nothing to make: all is up to date"]


@pytest.mark.parametrize(
    ("seconds", "words"), [(40, "40 s"), (600, "10 min"), (3.5 * 3600, "3.5 h")]
)
def test_durations_in_words(seconds: float, words: str) -> None:
    assert duration_in_words(seconds) == words
