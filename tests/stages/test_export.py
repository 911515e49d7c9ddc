"""Exports read back the way their users read them, and compared with the artifacts."""

import hashlib
import json
from pathlib import Path

import h5py
import numpy as np
import pyarrow.parquet as pq
import pytest
import trimesh
import webdataset

from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from pipeline.interchange.object_grasps import ObjectGrasps
from pipeline.interchange.reading import grasps_by_object
from pipeline.interchange.tar_shards import CLASSES
from pipeline.messages.objects import read_objects
from pipeline.messages.samples import read_split
from pipeline.network.samples import SPLITS, Samples
from stages.export import Format, export_run

LEAST = 0.6


@pytest.fixture(scope="module")
def grasps(run: RunFolder) -> list[ObjectGrasps]:
    names = ("objects", "scenes", "grasps")
    return grasps_by_object(*(run.artifact(name) for name in names))


def acronym_load(path: Path, root: Path) -> tuple[trimesh.Trimesh, np.ndarray, np.ndarray]:
    """A file as ACRONYM's loaders take it apart: mesh by file and scale, transforms, success."""
    with h5py.File(path, "r") as data:
        mesh = trimesh.load(root / data["object/file"][()].decode(), force="mesh")
        mesh.apply_scale(data["object/scale"][()])
        success = np.array(data["grasps/qualities/flex/object_in_gripper"])
        return mesh, np.array(data["grasps/transforms"]), success


def test_acronym_files_hold_every_grasp(run: RunFolder, grasps: list[ObjectGrasps]) -> None:
    into = export_run(run, Format.ACRONYM, LEAST)
    assert (
        sum(map(len, grasps)) == json.loads((into / "manifest.json").read_text())["grasps"] == 240
    )
    for found in grasps:
        path = into / "grasps" / f"{found.item.name}_1.h5"
        mesh, transforms, success = acronym_load(path, into)
        np.testing.assert_allclose(mesh.extents, found.item.mesh.extents_m, atol=1e-7)
        assert mesh.volume == pytest.approx(found.item.volume_m3, rel=1e-4)
        np.testing.assert_array_equal(transforms, found.object_from_base)
        np.testing.assert_array_equal(success, found.quality >= LEAST)
        with h5py.File(path, "r") as data:
            ours = data["grasps/qualities/softgrip"]
            np.testing.assert_array_equal(ours["quality"], found.quality)
            assert tuple(name.decode() for name in ours["scene"][()]) == found.scene


def test_the_gripper_approaches_the_object_along_z(grasps: list[ObjectGrasps]) -> None:
    """A full seal lies on the object: from above its origin, +z leads to the surface there."""
    seen = 0
    for found in grasps:
        item = found.item.mesh
        surface = trimesh.Trimesh(item.vertices_m, item.faces, process=False)
        sealed = found.object_from_base[found.pressure > 0.99]
        if not len(sealed):
            continue
        origins, approach = sealed[:, :3, 3], sealed[:, :3, 2]
        hits, rays, _ = surface.ray.intersects_location(
            origins - 0.05 * approach, approach, multiple_hits=False
        )
        assert len(rays) == len(sealed)
        depth = np.einsum("ij,ij->i", hits - origins[rays], approach[rays])
        # First touch is above what the centre falls on, within the pad's reach.
        assert depth.min() > -1e-4
        assert depth.max() < 0.03
        seen += len(sealed)
    assert seen > 10


def test_poses_come_back_to_the_scene(run: RunFolder, grasps: list[ObjectGrasps]) -> None:
    """The same transforms by another way: rigid, and as many as the scenes have grasps."""
    for found in grasps:
        rotation = found.object_from_base[:, :3, :3]
        product = rotation @ rotation.transpose(0, 2, 1)
        np.testing.assert_allclose(product, np.broadcast_to(np.eye(3), product.shape), atol=1e-9)
        np.testing.assert_allclose(np.linalg.det(rotation), 1.0, atol=1e-9)


def test_graspgen_reads_what_was_labelled(run: RunFolder, grasps: list[ObjectGrasps]) -> None:
    into = export_run(run, Format.GRASPGEN, LEAST)
    by_name = {found.item.name: found for found in grasps}
    files = sorted((into / "grasps").glob("*.json"))
    assert {path.stem for path in files} == set(by_name)
    for path in files:
        data, found = json.loads(path.read_text()), by_name[path.stem]
        mesh = trimesh.load(into / "objects" / data["object"]["file"], force="mesh")
        mesh.apply_scale(data["object"]["scale"])
        np.testing.assert_allclose(mesh.extents, found.item.mesh.extents_m, atol=1e-7)
        transforms = np.array(data["grasps"]["transforms"])
        mask = np.array(data["grasps"]["object_in_gripper"])
        np.testing.assert_array_equal(transforms[mask], found.object_from_base[mask])
        np.testing.assert_array_equal(mask, found.quality >= LEAST)
    split_of = {name: split for name, (_, split) in read_objects(run.artifact("objects")).items()}
    for split, name in (("train", "train.txt"), ("val", "valid.txt"), ("test", "test.txt")):
        listed = (into / "splits" / name).read_text().split()
        assert all(split_of[item.removesuffix(".obj")] == split for item in listed)
        assert all((into / "objects" / item).is_file() for item in listed)


def test_webdataset_gives_the_samples_in_order(run: RunFolder) -> None:
    into = export_run(run, Format.WEBDATASET, LEAST)
    for split in SPLITS:
        samples = read_split(run.artifact("shards"), split)
        tars = [str(path) for path in sorted(into.glob(f"{split}-*.tar"))]
        rows = list(webdataset.WebDataset(tars, shardshuffle=False).decode())
        assert len(rows) == len(samples)
        for index, row in enumerate(rows):
            np.testing.assert_array_equal(row["cloud.npy"], samples.cloud[index])
            np.testing.assert_array_equal(row["mask.npy"], samples.cloud_mask[index])
            check_facts(row["json"], samples, index)


def test_parquet_gives_the_samples_in_order(run: RunFolder) -> None:
    into = export_run(run, Format.PARQUET, LEAST)
    for split in SPLITS:
        samples = read_split(run.artifact("shards"), split)
        table = pq.read_table(sorted(into.glob(f"{split}-*.parquet")))
        cells = int(table.schema.metadata[b"softgrip.cells"])
        cloud = table["cloud"].combine_chunks().flatten().to_numpy()
        shape = (len(samples), cells, cells)
        np.testing.assert_array_equal(cloud.reshape(*shape, 3), samples.cloud)
        mask = table["mask"].combine_chunks().flatten().to_numpy(zero_copy_only=False)
        np.testing.assert_array_equal(mask.reshape(shape), samples.cloud_mask)
        facts = table.drop_columns(["cloud", "mask"]).to_pylist()
        for index, row in enumerate(facts):
            assert row["key"] == f"{split}-{index:08d}"
            check_facts(row, samples, index)


def check_facts(row: dict, samples: Samples, index: int) -> None:
    assert row["quality"] == pytest.approx(float(samples.quality[index]), abs=1e-7)
    assert row["pressure"] == pytest.approx(float(samples.pressure[index]), abs=1e-7)
    assert row["level"] == samples.level[index]
    assert row["shape_class"] == CLASSES[samples.shape_class[index]]
    assert isinstance(row["object"], str)
    assert row["pictures"] == samples.pictures[index]
    assert row["proposal_weight"] == pytest.approx(float(samples.proposal_weight[index]))


@pytest.mark.parametrize("wanted", Format)
def test_an_export_has_the_same_bytes_again(run: RunFolder, wanted: Format) -> None:
    def digests() -> dict[str, str]:
        into = export_run(run, wanted, LEAST)
        files = [path for path in sorted(into.rglob("*")) if path.is_file()]
        return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in files}

    first = digests()
    assert "manifest.json" in first
    assert digests() == first


def test_without_a_dataset_it_says_what_to_make(run: RunFolder) -> None:
    empty = RunFolder(run.path.parent / "nothing")
    for wanted in (Format.ACRONYM, Format.PARQUET):
        with pytest.raises(ArtifactError, match="make dataset RUN=nothing"):
            export_run(empty, wanted, LEAST)
