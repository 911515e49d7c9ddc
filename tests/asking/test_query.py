"""Questions are answered as the artifacts say, without a cloud, or refused in words."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact
from pipeline.artifacts.bounds import BoundedFile
from pipeline.artifacts.sharding import listed_shards, shard_entry, shard_path, write_index
from pipeline.asking.query import ask
from pipeline.errors import ArtifactError, QueryError
from pipeline.labelling.grasps import LabelledGrasps
from pipeline.messages.grasps import read_grasps, write_grasps
from schemas.softgrip.v1.evaluation_pb2 import Attempt
from schemas.tables import BY_NAME, PAGE, QUESTIONS, TABLES, page
from tests.messages.test_messages import ORIGIN, some_grasps


def labelled(index: Path) -> list[LabelledGrasps]:
    found = []
    for shard in listed_shards(index):
        with open_artifact(shard) as artifact:
            found += [grasps for _, grasps in read_grasps(artifact, clouds=False)]
    return found


@pytest.mark.parametrize("question", QUESTIONS, ids=[words[:40] for words, _ in QUESTIONS])
def test_questions_of_a_working_day(
    question: tuple[str, str], made: dict[str, Path], cache: Path
) -> None:
    answer = ask(question[1], made, cache)
    assert answer.num_columns >= 3


def test_a_table_holds_every_row_as_its_artifact_does(made: dict[str, Path], cache: Path) -> None:
    grasps = labelled(made["grasps"])
    answer = ask("SELECT q, p, x_m, qw, qx, qy, qz, tilt_rad, grasp FROM grasps", made, cache)
    for name, expected in (
        ("q", np.concatenate([part.quality for part in grasps])),
        ("p", np.concatenate([part.pressure for part in grasps])),
        ("x_m", np.concatenate([part.world_from_gripper[:, 0, 3] for part in grasps])),
        ("tilt_rad", np.concatenate([part.tilt_rad for part in grasps])),
    ):
        np.testing.assert_array_equal(answer.column(name).to_numpy(), expected)
    quaternion = np.stack([answer.column(f"q{part}").to_numpy() for part in "xyzw"], axis=1)
    turns = np.concatenate([part.world_from_gripper[:, :3, :3] for part in grasps])
    np.testing.assert_allclose(Rotation.from_quat(quaternion).as_matrix(), turns, atol=1e-9)
    for table in TABLES:
        (count,) = ask(f"SELECT count(*) AS n FROM {table.name}", made, cache).column("n")
        assert count.as_py() > 0 or table.name == "refused"


def test_counts_agree_with_the_messages(made: dict[str, Path], cache: Path) -> None:
    with open_artifact(made["evaluate"]) as artifact:
        lifted = sum(m.outcome == "lifted" for _, m in artifact.messages(Attempt))
    sql = "SELECT count(*) AS n FROM attempts WHERE outcome = 'lifted' AND cause IS NULL"
    assert ask(sql, made, cache).column("n").to_pylist() == [lifted]
    sql = "SELECT count(*) AS n FROM grasps JOIN placed_objects USING (scene, body_id, object)"
    rows = sum(len(part) for part in labelled(made["grasps"]))
    assert ask(sql, made, cache).column("n").to_pylist() == [rows]


def test_what_a_file_does_not_tell_is_null(made: dict[str, Path], cache: Path) -> None:
    answer = ask("SELECT count(key) AS k, count(object) AS n FROM objects", made, cache)
    assert answer.column("k").to_pylist() == [0]
    assert answer.column("n").to_pylist()[0] > 0
    answer = ask("SELECT count(proposal_weight) AS w FROM samples", made, cache)
    assert answer.column("w").to_pylist() == [0]


FULL = replace(
    ORIGIN,
    limit_names=tuple(f"limit {n}" for n in range(8)),
    status_names=("solved", "infeasible", "stopped", "no contact"),
    proposal_names=("normal", "tilted", "nearby"),
)


def posed_grasps(count: int) -> LabelledGrasps:
    """Some grasps whose poses are poses."""
    return replace(some_grasps(count), world_from_gripper=np.tile(np.eye(4), (count, 1, 1)))


def grasps_run(folder: Path, provenance: Provenance, counts: list[int]) -> Path:
    """Shards of the present version."""
    index, entries = folder / "grasps.mcap", []
    for number, count in enumerate(counts):
        path = shard_path(folder / "grasps", number, len(counts))
        with ArtifactWriter(path, provenance) as artifact:
            write_grasps(artifact, [(FULL, posed_grasps(count))], 16, True)
        entries.append(shard_entry(path, folder, count, "train"))
    write_index(index, provenance, entries, np.arange(10))
    return index


def test_a_question_about_q_touches_no_cloud(
    tmp_path: Path, provenance: Provenance, monkeypatch: pytest.MonkeyPatch
) -> None:
    index = grasps_run(tmp_path, provenance, [64, 32])
    read: list[int] = []
    really = BoundedFile.read

    def counted(file: BoundedFile, size: int | None = -1, /) -> bytes:
        data = really(file, size)
        read.append(len(data))
        return data

    monkeypatch.setattr(BoundedFile, "read", counted)
    sql = "SELECT avg(q) AS q FROM grasps"
    first = ask(sql, {"grasps": index}, tmp_path / "tables")
    shards = sum(path.stat().st_size for path in tmp_path.glob("grasps/*.mcap"))
    assert 0 < sum(read) < 0.3 * shards
    read.clear()
    assert ask(sql, {"grasps": index}, tmp_path / "tables") == first
    assert not read  # the table is there


def test_a_run_that_is_written_meanwhile_gives_its_last_whole_state(
    tmp_path: Path, provenance: Provenance
) -> None:
    sql = "SELECT count(*) AS n, avg(q) AS q FROM grasps"
    index = grasps_run(tmp_path, provenance, [8, 8])
    before = ask(sql, {"grasps": index}, tmp_path / "tables")
    other = Provenance(**{**vars(provenance), "key": "another"})
    shard = shard_path(tmp_path / "grasps", 0, 2)
    with ArtifactWriter(shard, other) as artifact:
        write_grasps(artifact, [(FULL, posed_grasps(5))], 16, True)
    assert ask(sql, {"grasps": index}, tmp_path / "tables") == before
    with pytest.raises(ArtifactError, match="being made anew"):
        ask(sql, {"grasps": index}, tmp_path / "nothing asked before")
    shutil.rmtree(tmp_path / "grasps")
    after = ask(sql, {"grasps": grasps_run(tmp_path, other, [8, 3])}, tmp_path / "tables")
    assert after.column("n").to_pylist() == [11]
    assert len(list((tmp_path / "tables").glob("grasps-*"))) == 1


def test_a_file_whose_words_are_gone_is_named(tmp_path: Path, provenance: Provenance) -> None:
    index = grasps_run(tmp_path, provenance, [8])
    shard = shard_path(tmp_path / "grasps", 0, 1)
    with ArtifactWriter(shard, provenance) as artifact:
        write_grasps(artifact, [(ORIGIN, posed_grasps(8))], 16, True)
    with pytest.raises(ArtifactError, match=r"00000-of-00001\.mcap: A row has word"):
        ask("SELECT status FROM grasps", {"grasps": index}, tmp_path / "tables")


@pytest.mark.parametrize(
    ("sql", "told"),
    [
        ("SELECT qq FROM grasps", "Columns are grasps: scene, grasp, viewpoint"),
        ("SELECT qualit FROM objects", "objects: object, split, shape_class"),
        ("SELEC q FROM grasps", "syntax error"),
        ("SELECT * FROM gasps", "Did you mean grasps? Tables are objects, refused, scenes"),
        ("SELECT made FROM cache", "Tables are"),
        ("SELECT status + q FROM grasps", "Columns are grasps"),
    ],
)
def test_wrong_sql_is_told_with_what_there_is(
    sql: str, told: str, made: dict[str, Path], cache: Path
) -> None:
    with pytest.raises(QueryError) as refused:
        ask(sql, made, cache)
    assert told in str(refused.value)


def test_a_table_that_is_not_made_is_named(made: dict[str, Path], cache: Path) -> None:
    del made["evaluate"]
    with pytest.raises(QueryError, match="attempts: evaluate not made"):
        ask("SELECT * FROM attempts", made, cache)


def test_the_page_of_the_tables_is_up_to_date() -> None:
    assert PAGE.read_text() == page()
    for table in BY_NAME.values():
        names = [column.name for column in table.columns]
        assert len(set(names)) == len(names)
