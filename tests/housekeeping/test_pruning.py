"""What is freed can be made again; what is not finished, shared or in use is left alone."""

from pathlib import Path

from filelock import FileLock

from pipeline.execution import RunFolder
from pipeline.housekeeping.pruning import free, freeable, in_use, is_finished
from tests.housekeeping.conftest import STAGES, make_run, make_stage


def fill(path: Path, size: int = 100) -> None:
    path.mkdir(parents=True)
    (path / "part").write_bytes(b"x" * size)


def finished_run(path: Path) -> RunFolder:
    folder = make_run(path)
    for stage in STAGES:
        make_stage(folder, stage)
    fill(folder.state("samples"), 5000)
    fill(folder.state("train"), 70)
    fill(folder.path / "export" / "acronym", 30)
    fill(folder.shards("grasps"), 900)
    fill(folder.cache, 1)
    return folder


def test_what_can_be_made_again_is_shown_with_size_and_way(tmp_path: Path) -> None:
    folder = finished_run(tmp_path / "one")
    found = {item.path: item for item in freeable(folder, STAGES)}
    assert {path: item.size_bytes for path, item in found.items()} == {
        folder.state("samples"): 5000,
        folder.state("train"): 70,
        folder.path / "export" / "acronym": 30,
    }
    assert found[folder.path / "export" / "acronym"].again_by == "make export FORMAT=acronym"


def test_showing_deletes_nothing_and_freeing_deletes_just_that(tmp_path: Path) -> None:
    folder = finished_run(tmp_path / "one")
    before = {path for path in tmp_path.rglob("*") if path.is_file()}
    shown = freeable(folder, STAGES)
    assert {path for path in tmp_path.rglob("*") if path.is_file()} == before
    assert free(folder, STAGES) == shown
    gone = before - {path for path in tmp_path.rglob("*") if path.is_file()}
    assert gone == {item.path / "part" for item in shown}
    assert freeable(folder, STAGES) == []


def test_resume_points_of_an_unfinished_stage_stay(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "one")
    fill(folder.state("train"))
    fill(folder.state("samples"))
    assert freeable(folder, STAGES) == []


def test_resume_points_of_a_stage_that_is_made_anew_stay(tmp_path: Path) -> None:
    folder = finished_run(tmp_path / "one")
    assert is_finished(folder, "train")
    folder.state("train.key").write_text("of another configuration")
    assert not is_finished(folder, "train")
    assert folder.state("train") not in [item.path for item in freeable(folder, STAGES)]


def test_a_run_that_a_process_works_in_is_left_alone(tmp_path: Path) -> None:
    folder = finished_run(tmp_path / "one")
    assert not in_use(folder)
    with FileLock(folder.state("lock")):
        assert in_use(folder)
        assert free(folder, STAGES) == []
    assert folder.state("samples").is_dir()
    assert not in_use(folder)
