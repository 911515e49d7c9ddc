"""What the list says of each run is what lies in its folder."""

from pathlib import Path

import pytest

from pipeline.execution.sealing import seal
from pipeline.housekeeping.listing import (
    EMBEDDED,
    as_table,
    disk_use_bytes,
    facts_of,
    run_folders,
    size_in_words,
)
from tests.housekeeping.conftest import STAGES, make_run, make_stage


def test_runs_within_runs_are_found_and_other_folders_are_not(tmp_path: Path) -> None:
    for name in ("a", "a/folds", "a/folds/fold-0", "b"):
        make_run(tmp_path / name)
    (tmp_path / "pictures").mkdir()
    (tmp_path / ".cache").mkdir()
    names = [f.path.relative_to(tmp_path).as_posix() for f in run_folders(tmp_path)]
    assert names == ["a", "a/folds", "a/folds/fold-0", "b"]


def test_a_folder_of_no_runs_lists_none(tmp_path: Path) -> None:
    assert list(run_folders(tmp_path / "missing")) == []


def test_facts_are_those_of_the_summaries(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "one")
    make_stage(folder, "objects", objects=47)
    make_stage(folder, "train", test_mae_single=0.0507)
    make_stage(folder, "evaluate", policies={"closed-loop": {"rate": 0.8}, "open-loop": {}})
    folder.state("mesh_dir").write_text("meshes/mine")
    facts = facts_of(folder, tmp_path, STAGES)
    assert facts.made == ("objects", "train", "evaluate")
    assert facts.headline == {"objects": 47, "test |e|": 0.0507, "success": 0.8}
    assert facts.made_from == "meshes/mine"
    assert not facts.sealed
    seal(folder)
    assert facts_of(folder, tmp_path, STAGES).sealed


def test_a_run_of_embedded_objects_and_a_given_network_says_so(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "one")
    assert facts_of(folder, tmp_path, STAGES).made_from == ""
    make_stage(folder, "objects", objects=18)
    folder.summary("holdout").write_text('{"network": "released"}')
    assert facts_of(folder, tmp_path, STAGES).made_from == f"{EMBEDDED}; network released"


def test_a_damaged_summary_gives_no_figures(tmp_path: Path) -> None:
    folder = make_run(tmp_path / "one")
    make_stage(folder, "objects", objects=18)
    folder.summary("objects").write_text("{cut")
    assert facts_of(folder, tmp_path, STAGES).headline == {}


def test_disk_use_counts_every_file_once_and_follows_no_link(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a").write_bytes(b"x" * 300)
    (tmp_path / "b").write_bytes(b"x" * 20)
    (tmp_path / "folder").symlink_to(tmp_path / "in")
    assert disk_use_bytes(tmp_path) == 320
    assert disk_use_bytes(tmp_path / "b") == 20
    assert disk_use_bytes(tmp_path / "missing") == 0


@pytest.mark.parametrize(
    ("size", "words"), [(0, "0 B"), (999, "999 B"), (1230, "1.23 kB"), (2.27e9, "2.27 GB")]
)
def test_sizes_in_words(size: float, words: str) -> None:
    assert size_in_words(size) == words


def test_columns_of_a_table_line_up() -> None:
    assert as_table([["run", "disk"], ["paper", "2 GB"]]) == "run    disk\npaper  2 GB\n"
