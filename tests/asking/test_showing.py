"""The grasps or attempts of an answer, and no others, are recorded."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from rerun.chunk import RrdReader

from pipeline.artifacts import ArtifactWriter, open_artifact, to_tensor
from pipeline.asking.query import ask
from pipeline.asking.showing import show_answer
from pipeline.config import RunConfig
from pipeline.errors import ArtifactError, QueryError
from schemas.softgrip.v1.evaluation_pb2 import Attempt


def notes(recording: Path, entity: str) -> list[str]:
    found: list[str] = []
    for chunk in RrdReader(recording).stream():
        batch = chunk.to_record_batch()
        if chunk.entity_path == entity and "TextDocument:text" in batch.schema.names:
            found += [text for (text,) in batch["TextDocument:text"].to_pylist()]
    return found


@pytest.mark.parametrize("order", ["q DESC", "q", "grasp, scene"])
def test_grasps_of_an_answer_in_its_order(
    order: str, made: dict[str, Path], cache: Path, tmp_path: Path
) -> None:
    sql = f"SELECT scene, grasp, object, q FROM grasps ORDER BY {order} LIMIT 2"
    answer = ask(sql, made, cache)
    told = notes(show_answer(answer, made, RunConfig(), tmp_path / "q.rrd"), "/notes/grasp")
    assert len(told) == 2
    for text, row in zip(told, answer.to_pylist(), strict=True):
        assert f"q = {row['q']:.3f}" in text
        assert row["object"] in text
        assert row["scene"] in text


def with_candidates(evaluate: Path, path: Path) -> Path:
    """Attempts of 0.1.0 with the fields that films are drawn from and that version did not have."""
    with open_artifact(evaluate) as old, ArtifactWriter(path, old.provenance) as new:
        for time_ns, attempt in old.messages(Attempt):
            attempt.policy = "closed-loop"
            attempt.candidate_poses.CopyFrom(to_tensor(np.eye(4, dtype=np.float32)[None]))
            attempt.candidate_quality.CopyFrom(to_tensor(np.ones(1, dtype=np.float32)))
            new.write("/attempts", attempt, time_ns)
            attempt.attempt += 100
            new.write("/attempts", attempt, time_ns)
    return path


def test_attempts_of_an_answer(made: dict[str, Path], tmp_path: Path) -> None:
    made["evaluate"] = with_candidates(made["evaluate"], tmp_path / "evaluate.mcap")
    sql = "SELECT scene, policy, attempt FROM attempts WHERE attempt >= 100"
    answer = ask(sql, made, tmp_path / "tables")
    assert answer.num_rows == ask("FROM attempts", made, tmp_path / "tables").num_rows / 2
    told = notes(show_answer(answer, made, RunConfig(), tmp_path / "q.rrd"), "/notes/attempt")
    assert len(told) == answer.num_rows > 0
    for text, row in zip(told, answer.to_pylist(), strict=True):
        assert f"({row['scene']}, attempt {row['attempt']})" in text


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        ({"q": [0.5]}, "Ask for columns scene and grasp"),
        ({"scene": pa.array([], pa.string()), "grasp": pa.array([], pa.int64())}, "names 0 grasps"),
        ({"scene": ["s"] * 501, "grasp": list(range(501))}, "LIMIT 500"),
    ],
    ids=["no columns", "no rows", "too many"],
)
def test_what_cannot_be_shown_is_told(
    answer: dict[str, list[object]], told: str, made: dict[str, Path], tmp_path: Path
) -> None:
    with pytest.raises(QueryError, match=told):
        show_answer(pa.table(answer), made, RunConfig(), tmp_path / "q.rrd")


def test_a_scene_of_another_run_is_named(made: dict[str, Path], tmp_path: Path) -> None:
    with pytest.raises(ArtifactError, match="no scene 'elsewhere'"):
        show_answer(
            pa.table({"scene": ["elsewhere"], "grasp": [0]}), made, RunConfig(), tmp_path / "q.rrd"
        )
