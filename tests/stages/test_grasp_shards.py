"""A scene on which no grasp can be tried: refused, or left out by name."""

from dataclasses import replace
from pathlib import Path

import pyarrow as pa
import pytest
from loguru import logger

from pipeline.artifacts import read_provenance
from pipeline.asking.cache import QUERY_CACHE, arrow_table
from pipeline.asking.rows import ROWS
from pipeline.config import load_run_config
from pipeline.errors import SceneError
from pipeline.execution import RunFolder
from pipeline.messages.scenes import scene_places
from pipeline.recording.grasps import shown_grasps
from stages.grasp_shards import Portion, ShardJob, synthesize_shard


@pytest.fixture
def unseen(run: RunFolder, tmp_path: Path) -> ShardJob:
    """Grasps are wanted where a surface faces the camera exactly: nowhere."""
    config = load_run_config(run.config)
    grasps = config.grasps.model_copy(update={"seen_angle_max_rad": 1e-9})
    return ShardJob(
        scene=scene_places(run.artifact("scenes"))[0],
        portions=(Portion(0, 10, None),),
        basis="a basis",
        pads=2,
        shard=tmp_path / "shard.mcap",
        rows=tmp_path / "rows.arrow",
        objects=run.artifact("objects"),
        config=config.model_copy(update={"grasps": grasps}),
        provenance=read_provenance(run.artifact("grasps")),
    )


def test_it_ends_a_run_in_one_sentence(unseen: ShardJob) -> None:
    with pytest.raises(SceneError, match=r"No camera of scene .* sees a surface face on"):
        synthesize_shard(unseen)
    assert not unseen.shard.exists()


def test_where_clutters_may_be_left_out_its_shard_is_empty_and_says_so(unseen: ShardJob) -> None:
    scenes = unseen.config.scenes.model_copy(update={"impossible": "left out"})
    job = replace(unseen, config=unseen.config.model_copy(update={"scenes": scenes}))
    told: list[str] = []
    sink = logger.add(told.append, format="{message}")
    made, found_again = synthesize_shard(job), synthesize_shard(job)
    logger.remove(sink)
    assert made.entry.samples == made.histogram.sum() == 0
    assert made.entry == found_again.entry
    assert made.entry.split == "train"
    assert len(told) == 1
    assert told[0].startswith("left out: No camera of scene")
    assert shown_grasps((), job.shard) == []
    assert pa.ipc.open_file(job.rows).read_all().num_rows == 0


def test_the_rows_that_the_stage_leaves_are_those_of_its_shards(
    run: RunFolder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read_back = arrow_table("grasps", run.artifact("grasps"), tmp_path).to_pylist()
    assert read_back
    monkeypatch.setitem(ROWS, "grasps", lambda path: pytest.fail(f"{path} is read for its rows"))
    kept = arrow_table("grasps", run.artifact("grasps"), run.state(QUERY_CACHE))
    assert kept.to_pylist() == read_back
    assert not run.state("grasps").exists()
