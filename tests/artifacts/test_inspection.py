"""`inspect` says what a file is; `verify` finds what is no longer as it was recorded."""

import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.artifacts import ArtifactWriter, Input, Provenance, file_sha256
from pipeline.artifacts.inspection import read_contents, verify_files
from pipeline.artifacts.sharding import shard_entry, shard_path, write_index
from schemas.softgrip.v1.objects_pb2 import CatalogueObject
from schemas.softgrip.v1.samples_pb2 import SampleBatch

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def run(tmp_path: Path, provenance: Provenance) -> Path:
    """A mesh, an objects artifact made from it, and an index of two shards made from that."""
    folder = tmp_path / "run"
    (folder / "meshes").mkdir(parents=True)
    (folder / "run.toml").touch()
    mesh = folder / "meshes" / "cube.ply"
    mesh.write_bytes(b"ply")
    objects = folder / "objects.mcap"
    made_of = (Input("meshes/cube.ply", file_sha256(mesh)),)
    with ArtifactWriter(objects, replace(provenance, inputs=made_of)) as artifact:
        artifact.write("/objects", CatalogueObject(name="cube"), log_time_ns=0)
        artifact.attach("note.txt", "text/plain", b"hello")
    later = replace(
        provenance, stage="grasps", inputs=(Input("objects.mcap", file_sha256(objects)),)
    )
    entries = []
    for index in range(2):
        path = shard_path(folder / "grasps", index, 2)
        with ArtifactWriter(path, later) as artifact:
            artifact.write("/samples", SampleBatch(), log_time_ns=index)
        entries.append(shard_entry(path, folder, 5, "train"))
    write_index(folder / "grasps.mcap", later, entries, np.arange(10))
    return folder


def problems(run: Path, name: str = "grasps.mcap") -> dict[str, str]:
    found = verify_files(run / name, run / "meshes")
    return {f.path.name: f.problem for f in found if f.problem}


def test_contents_are_told(run: Path, provenance: Provenance) -> None:
    objects = read_contents(run / "objects.mcap")
    assert objects.counts == {"/objects": ("softgrip.v1.CatalogueObject", 1)}
    assert objects.attachments == {"note.txt": 5}
    assert objects.provenance.seed == provenance.seed
    index = read_contents(run / "grasps.mcap")
    assert index.shards == {
        "grasps/00000-of-00002.mcap": 5,
        "grasps/00001-of-00002.mcap": 5,
    }


def test_a_whole_chain_is_followed_to_the_mesh_each_file_once(run: Path) -> None:
    found = [f.path.name for f in verify_files(run / "grasps.mcap", run / "meshes")]
    assert problems(run) == {}
    shards = {f"{index:05d}-of-00002.mcap" for index in range(2)}
    assert set(found) == {"grasps.mcap", "objects.mcap", "cube.ply", *shards}
    assert len(found) == len(set(found))


def test_a_changed_mesh_is_found_from_the_last_stage(run: Path) -> None:
    (run / "meshes" / "cube.ply").write_bytes(b"PLY")
    found = problems(run)
    assert list(found) == ["cube.ply"]
    assert "changed since objects.mcap was made" in found["cube.ply"]


def test_a_flipped_bit_in_a_shard_is_found(run: Path) -> None:
    shard = shard_path(run / "grasps", 1, 2)
    data = bytearray(shard.read_bytes())
    data[len(data) // 2] ^= 1
    shard.write_bytes(data)
    assert list(problems(run)) == [shard.name]
    assert list(problems(run, f"grasps/{shard.name}")) == [shard.name]


def test_what_is_missing_is_found(run: Path) -> None:
    shard_path(run / "grasps", 0, 2).unlink()
    (run / "meshes" / "cube.ply").unlink()
    assert set(problems(run)) == {"00000-of-00002.mcap", "cube.ply"}


def test_meshes_are_said_to_be_not_compared_where_their_folder_is_unknown(run: Path) -> None:
    found = [f for f in verify_files(run / "objects.mcap", None) if f.problem]
    assert [f.path.name for f in found] == ["cube.ply"]
    assert "--mesh-dir" in found[0].problem


def test_names_in_a_record_do_not_lead_out_of_the_folder(run: Path, provenance: Provenance) -> None:
    secret = run.parent / "secret"
    secret.write_bytes(b"x")
    outside = (
        Input("../secret", file_sha256(secret)),
        Input(str(secret), file_sha256(secret)),
        Input("meshes/../../secret", file_sha256(secret)),
    )
    with ArtifactWriter(run / "bad.mcap", replace(provenance, inputs=outside)) as artifact:
        artifact.write("/objects", CatalogueObject(), log_time_ns=0)
    found = [f for f in verify_files(run / "bad.mcap", run / "meshes") if f.problem]
    assert len(found) == len(outside)
    assert all("leads out of" in f.problem for f in found)


def command(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "pipeline.artifacts", *words],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


def test_from_the_command_line(run: Path) -> None:
    told = command("inspect", str(run / "objects.mcap"))
    assert told.returncode == 0
    for words in ("stage      objects, seed 7", "schemas softgrip.v1", "1 softgrip.v1.Catalogue"):
        assert words in told.stdout
    assert command("verify", str(run / "grasps.mcap"), "--mesh-dir", str(run / "meshes")).stdout
    (run / "meshes" / "cube.ply").write_bytes(b"PLY")
    wrong = command("verify", str(run / "grasps.mcap"), "--mesh-dir", str(run / "meshes"))
    assert wrong.returncode == 1
    assert "cube.ply: changed since objects.mcap was made" in wrong.stdout
    absent = command("inspect", str(run / "none.mcap"))
    assert absent.returncode == 1
    assert "none.mcap does not exist" in absent.stderr
    assert "Traceback" not in absent.stderr


def test_what_run_toml_names_is_followed(run: Path, provenance: Provenance) -> None:
    """Families and a network elsewhere, masses beside the meshes, another run's files."""
    other = run.parent / "other"
    shutil.copytree(run, other)
    (other / "run.toml").touch()
    families, weights = run.parent / "families.toml", other / "mine.safetensors"
    (run / "meshes" / "masses.toml").write_text("cube = 0.1")
    families.write_text("[families]")
    weights.write_bytes(b"weights")
    (run / "run.toml").write_text(
        '[split]\nfamilies = "../families.toml"\n[train]\nstart = "../other/mine.safetensors"\n'
        'further_runs = ["../other"]\n'
    )
    shutil.copy(other / "grasps.mcap", other / "shards.mcap")
    outside = {
        "families.toml": families,
        "masses.toml": run / "meshes" / "masses.toml",
        "start.safetensors": weights,
        "further/000/shards.mcap": other / "shards.mcap",
    }
    inputs = tuple(Input(name, file_sha256(path)) for name, path in outside.items())
    with ArtifactWriter(run / "train.mcap", replace(provenance, inputs=inputs)) as artifact:
        artifact.write("/objects", CatalogueObject(), log_time_ns=0)
    assert problems(run, "train.mcap") == {}
    found = {f.path.resolve() for f in verify_files(run / "train.mcap", run / "meshes")}
    assert set(outside.values()) <= found
    assert other / "objects.mcap" in found  # of the other run, up to its meshes
    weights.write_bytes(b"others")
    assert list(problems(run, "train.mcap")) == ["mine.safetensors"]
    (run / "run.toml").write_text("[train]\nsart = 1\n")
    wrong = problems(run, "train.mcap")
    assert "sart" in wrong["run.toml"]
    assert {"start.safetensors", "shards.mcap"} <= set(wrong)  # where they lie is not known then
