"""A run in an object store, made by two nodes that have no folder in common with the driver.

The store is a server that speaks S3. On a node, opening a path of the driver is an error.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
import trimesh

from pipeline.artifacts.object_store import ObjectStore, TakenError
from pipeline.config import load_run_config
from pipeline.errors import StoreError
from pipeline.execution import RunFolder, StageContext
from pipeline.execution.run_roots import LENT
from pipeline.execution.run_store import RunStore, look, opened
from pipeline.execution.stage import Stage
from pipeline.execution.staleness import stage_context
from stages import grasps, objects, shards, sweep
from stages.graph import GRASPS, OBJECTS, SHARDS, SWEEP, inputs_of
from tests.artifacts.s3.server import BUCKET, s3_server
from tests.stages.conftest import ROOT

cluster_utils = pytest.importorskip("ray.cluster_utils", reason="Ray is not installed")
PATIENCE_S = 300
URL = f"s3://{BUCKET}/runs"

ROD = """
<robot name="rod"><link name="rod"><visual><geometry>
<mesh filename="../parts/rod.stl"/>
</geometry></visual></link></robot>
"""
ONE_NETWORK = """
[sweep]
depths = [18]
channels = [[8, 8, 16, 16]]
seeds = 1
ablation_seeds = 0
samples = 32
held_out_samples = 16
epochs = 1
batch_size = 16
"""

# Python calls this at the start of every process of a node.
GUARD = """
import os, sys
driver = os.environ["FORBIDDEN_FOLDER"]
def refuse(event, args):
    if event in ("open", "os.listdir", "os.scandir", "os.chdir", "os.link", "os.rename"):
        for path in args:
            if isinstance(path, (str, bytes)) and os.fsdecode(path).startswith(driver):
                raise RuntimeError(f"a node opens {path!r}, which is the driver's")
sys.addaudithook(refuse)
"""


@pytest.fixture(scope="module")
def s3() -> Iterator[dict[str, str]]:
    with s3_server() as environment:
        yield environment


@pytest.fixture
def in_store(s3: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Every run lies in the store."""
    for name, value in {**s3, "RUN_STORE": URL}.items():
        monkeypatch.setenv(name, value)


@pytest.fixture
def cluster(
    s3: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[list[Callable[[], None]]]:
    """Two nodes with a folder each, and what kills each of them."""
    guard = tmp_path / "guard"
    guard.mkdir()
    (guard / "sitecustomize.py").write_text(GUARD)
    with monkeypatch.context() as of_nodes:
        for name, value in s3.items():
            of_nodes.setenv(name, value)
        of_nodes.setenv("PYTHONPATH", f"{guard}:{ROOT}")
        of_nodes.setenv("FORBIDDEN_FOLDER", str(tmp_path / "driver"))
        made = cluster_utils.Cluster(
            initialize_head=True, head_node_args={"num_cpus": 0, "object_store_memory": 10**8}
        )
        nodes = []
        for number in range(2):
            of_nodes.setenv("RUN_STORE_CACHE", str(tmp_path / f"node-{number}"))
            nodes.append(made.add_node(num_cpus=1, object_store_memory=10**8))
    monkeypatch.setenv("RAY_ADDRESS", made.address)
    yield [partial(made.remove_node, node, allow_graceful=False) for node in nodes]
    made.shutdown()


def context_of(
    stage: Stage, folder: RunFolder, store: RunStore | None, mesh_dir: Path | None = None
) -> StageContext:
    context = stage_context(stage, folder, inputs_of, mesh_dir, workers=1)
    return replace(context, store=store, executor="ray" if store else "local")


def digests(folder: RunFolder) -> dict[str, str]:
    """SHA-256 of grasps and shards."""
    files = [folder.artifact("grasps"), folder.artifact("shards")]
    files += sorted(p for s in ("grasps", "shards") for p in folder.shards(s).rglob("*.mcap"))
    return {
        path.relative_to(folder.path).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in files
    }


def killed_at_first_shard(store: ObjectStore, kill: Callable[[], None]) -> threading.Thread:
    """A thread that kills a node as soon as a shard of grasps is in the store."""

    def watch() -> None:
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            if any(key.startswith("grasps/") for key in store.listed()):
                kill()
                return
            time.sleep(0.05)

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    return thread


def open_there(path: str) -> str:
    """A job that opens a path as it is given."""
    return Path(path).read_text()


@pytest.mark.usefixtures("in_store")
def test_two_nodes_without_a_common_folder_make_the_bytes_of_local_processes(
    cluster: list[Callable[[], None]], run: RunFolder, tmp_path: Path
) -> None:
    from pipeline.execution.ray_executor import run_on_ray

    here = RunFolder(tmp_path / "driver" / "tiny")
    here.path.mkdir(parents=True)
    for path in (run.config, run.artifact("objects"), run.artifact("scenes")):
        shutil.copy(path, here.path)
    shutil.copytree(run.shards("scenes"), here.shards("scenes"))
    with pytest.raises(RuntimeError, match="which is the driver's"):
        list(run_on_ray(open_there, [str(here.config)]))
    store = ObjectStore(f"{URL}/tiny", 10.0)
    config = load_run_config(here.config).store
    with opened(here, config, "grasps") as kept:
        assert kept is not None
        kept.put()
        killer = killed_at_first_shard(store, cluster[0])
        grasps.build(context_of(GRASPS, here, kept))
        killer.join()
        kept.put()
    shutil.rmtree(here.path)  # the driver's machine is lost

    elsewhere = RunFolder(tmp_path / "driver" / "elsewhere" / "tiny")
    elsewhere.path.mkdir(parents=True)
    with opened(elsewhere, config, "shards") as kept:
        assert kept is not None
        shards.build(context_of(SHARDS, elsewhere, kept))
        kept.put()
    assert digests(elsewhere) == digests(run)
    held = store.listed()
    assert set(digests(run)) <= set(held)
    assert not [key for key in held if key.startswith(".state/shards")]  # all gathered
    (line,) = look(elsewhere)
    assert line.startswith(f"store: {URL}/tiny can be written and holds")


def write_meshes(folder: Path) -> Path:
    """A mesh, a glTF that keeps its data beside it, and a URDF that places a mesh; the folder."""
    for name in ("", "urdf", "parts"):
        (folder / name).mkdir(parents=True)
    trimesh.creation.box((0.05, 0.06, 0.07)).export(folder / "box.ply")
    files = trimesh.exchange.gltf.export_gltf(trimesh.Scene(trimesh.creation.icosphere(2, 0.04)))
    for name, data in files.items():
        (folder / name.replace("model", "ball")).write_bytes(data)
    trimesh.creation.cylinder(0.02, 0.1).export(folder / "parts" / "rod.stl")
    (folder / "urdf" / "rod.urdf").write_text(ROD)
    return folder


@pytest.mark.usefixtures("in_store", "cluster")
def test_nodes_read_meshes_and_train_networks_that_only_the_driver_has(
    run: RunFolder, tmp_path: Path
) -> None:
    meshes = write_meshes(tmp_path / "driver" / "meshes")
    there, here = (RunFolder(tmp_path / place / "tiny") for place in ("driver", "alone"))
    for folder in (there, here):
        shutil.copytree(run.shards("shards"), folder.shards("shards"))
        shutil.copy(run.artifact("shards"), folder.path)
        folder.config.write_text(run.config.read_text() + ONE_NETWORK)
    for stage, module, given in ((OBJECTS, objects, meshes), (SWEEP, sweep, None)):
        with opened(there, load_run_config(there.config).store, stage.name) as kept:
            assert kept is not None
            kept.put()
            from_store = module.build(context_of(stage, there, kept, given))
        alone = module.build(context_of(stage, here, None, given))
        made = [folder.artifact(stage.name).read_bytes() for folder in (there, here)]
        assert made[0] == made[1]
        if stage is OBJECTS:
            assert from_store == alone
            assert from_store["objects"] == 3
    held = ObjectStore(f"{URL}/tiny", 10.0).listed()
    assert not [key for key in held if key.startswith(LENT)]  # nobody needs them any more


@pytest.mark.usefixtures("in_store")
def test_a_stage_on_an_empty_machine_finds_its_run_finished(run: RunFolder, tmp_path: Path) -> None:
    """As a person calls it: the whole run comes, run.toml too, and nothing is made again."""
    there = RunFolder(tmp_path / "one" / "finished")
    shutil.copytree(run.path, there.path)
    with opened(there, load_run_config(there.config).store, "grasps") as kept:
        assert kept is not None
        kept.put()
    runs = tmp_path / "two"
    done = subprocess.run(
        [
            *(sys.executable, "-m", "stages.grasps", "--run", "finished"),
            *("--runs-dir", str(runs), "--workers", "1"),
        ],
        cwd=ROOT,
        env=os.environ,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert f"files came from {URL}/finished" in done.stderr
    assert "grasps: up to date, nothing to do" in done.stderr
    assert "are in" not in done.stderr  # nothing new is put
    assert digests(RunFolder(runs / "finished")) == digests(run)


@pytest.mark.usefixtures("in_store")
def test_the_server_takes_the_first_writer(tmp_path: Path) -> None:
    store = ObjectStore(f"s3://{BUCKET}/conditions", 5.0)
    first = store.put_if("shard", b"first", None)
    with pytest.raises(TakenError):
        store.put_if("shard", b"second", None)
    second = store.put_if("shard", b"second", first)
    with pytest.raises(TakenError):
        store.put_if("shard", b"third", first)
    large = tmp_path / "large"
    large.write_bytes(os.urandom(12 * 2**20))  # in parts
    store.put("large", large)
    store.fetch("large", tmp_path / "back")
    assert (tmp_path / "back").read_bytes() == large.read_bytes()
    assert store.listed()["shard"].version == second == store.put("shard", b"second")
    with pytest.raises(StoreError, match="has no such bucket"):
        ObjectStore("s3://another/runs", 5.0).put("a", b"")
