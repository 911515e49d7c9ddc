"""BOP, COCO and USD of the tiny run, read back by pycocotools and OpenUSD, BOP by its layout."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from pxr import Usd, UsdGeom
from pycocotools.coco import COCO

from pipeline.artifacts import open_artifact
from pipeline.artifacts.sharding import listed_shards
from pipeline.execution import RunFolder
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.interchange.bop import silhouette
from pipeline.messages.grasps import read_grasps
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scenes
from pipeline.world.scene import ClutterScene
from pipeline.world.view import CameraView
from stages.export import Format, export_run
from tests.camera.scenes import box, seen

LEAST = 0.5


@pytest.fixture(scope="module")
def scenes(run: RunFolder) -> list[ClutterScene]:
    return list(read_scenes(run.artifact("scenes")))


@pytest.fixture(scope="module")
def objects(run: RunFolder) -> dict[str, CatalogueObject]:
    return {name: item for name, (item, _) in read_objects(run.artifact("objects")).items()}


@pytest.fixture(scope="module")
def bop(run: RunFolder) -> Path:
    return export_run(run, Format.BOP, LEAST)


def folder_of(bop: Path, scenes: list[ClutterScene], number: int) -> Path:
    return bop / scenes[number].split / f"{number:06d}"


def loaded(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text())
    return content


def test_models_are_the_objects_in_millimetres(
    bop: Path, objects: dict[str, CatalogueObject]
) -> None:
    info = loaded(bop / "models" / "models_info.json")
    assert {entry["name"] for entry in info.values()} == set(objects)
    number, entry = next(iter(info.items()))
    mesh = trimesh.load(bop / "models" / f"obj_{int(number):06d}.ply", process=False)
    expected = objects[entry["name"]].mesh
    assert mesh.vertices == pytest.approx(1e3 * expected.vertices_m, abs=1e-3)
    assert (mesh.faces == expected.faces).all()
    corners = 1e3 * expected.vertices_m[:400]
    far = np.linalg.norm(corners[:, None] - corners[None], axis=2).max()
    assert far - 1e-6 <= entry["diameter"] <= np.linalg.norm(1e3 * expected.extents_m) + 1e-6


def test_depth_comes_back_to_the_models_at_their_poses(
    bop: Path, scenes: list[ClutterScene]
) -> None:
    """By BOP's layout alone: a pixel of an object, unprojected, lies on its posed model."""
    folder = folder_of(bop, scenes, 0)
    cameras, truth = loaded(folder / "scene_camera.json"), loaded(folder / "scene_gt.json")
    camera, checked = cameras["0"], 0
    k = np.array(camera["cam_K"]).reshape(3, 3)
    depth_mm = np.asarray(Image.open(folder / "depth" / "000000.png")) * camera["depth_scale"]
    for index, pose in enumerate(truth["0"]):
        mask = np.asarray(Image.open(folder / "mask_visib" / f"000000_{index:06d}.png")) > 0
        rows, columns = np.nonzero(mask & (depth_mm > 0))
        if len(rows) < 50:
            continue
        z = depth_mm[rows, columns]
        points = np.stack(
            [(columns - k[0, 2]) / k[0, 0] * z, (rows - k[1, 2]) / k[1, 1] * z, z], axis=1
        )
        turn = np.array(pose["cam_R_m2c"]).reshape(3, 3)
        local = (points - np.array(pose["cam_t_m2c"])) @ turn
        mesh = trimesh.load(bop / "models" / f"obj_{pose['obj_id']:06d}.ply")
        chosen = np.random.default_rng(0).choice(len(local), 50)
        _, away, _ = trimesh.proximity.closest_point(mesh, local[chosen])
        assert np.median(away) < 0.5
        checked += 1
    assert checked


def test_visible_masks_are_the_segmentation(bop: Path, scenes: list[ClutterScene]) -> None:
    folder, scene = folder_of(bop, scenes, 0), scenes[0]
    info = loaded(folder / "scene_gt_info.json")
    for image, view in enumerate(scene.views):
        for index, placed in enumerate(scene.objects):
            name = f"{image:06d}_{index:06d}.png"
            visible = np.asarray(Image.open(folder / "mask_visib" / name)) > 0
            mask = np.asarray(Image.open(folder / "mask" / name)) > 0
            assert (visible == (view.segmentation == placed.body_id)).all()
            assert not (visible & ~mask).any()
            entry = info[str(image)][index]
            assert entry["px_count_visib"] == visible.sum()
            assert entry["px_count_all"] >= mask.sum()
            assert 0 <= entry["visib_fract"] <= 1


def test_pycocotools_reads_the_masks(bop: Path, scenes: list[ClutterScene]) -> None:
    folder, scene = folder_of(bop, scenes, 0), scenes[0]
    coco = COCO(folder / "scene_gt_coco.json")
    assert len(coco.getImgIds()) == len(scene.views)
    for annotation in coco.loadAnns(coco.getAnnIds()):
        view = scene.views[annotation["image_id"]]
        mask = coco.annToMask(annotation).astype(bool)
        assert mask.sum() == annotation["area"]
        rows, columns = np.nonzero(mask)
        if len(rows):
            body = view.segmentation[rows[0], columns[0]]
            assert (mask == (view.segmentation == body)).all()
            left, top, wide, high = annotation["bbox"]
            assert (columns.min(), rows.min()) == (left, top)
            assert (np.ptp(columns) + 1, np.ptp(rows) + 1) == (wide, high)


def test_a_silhouette_is_whole_behind_others_and_beyond_the_edge() -> None:
    shape = box((0.1, 0.1, 0.1), (0.0, 0.0, 0.05))
    alone = seen([shape], (0.0, -0.4, 0.5), 0.0, posed=True)
    truth = alone.depth_m > 0
    half = truth.copy()
    half[:, : half.shape[1] // 2] = False
    nothing = np.zeros((*truth.shape, 3), dtype=np.uint8)
    view = CameraView(alone.camera, alone.depth_m, nothing, half.astype(np.uint16), nothing)
    found = silhouette(view, 1, shape)
    assert (found.mask == truth).all()
    assert found.whole_px == truth.sum()
    assert (found.visible == half).all()
    beside = seen([box((0.1, 0.1, 0.1), (0.3, 0.0, 0.05))], (0.0, -0.4, 0.5), 0.0, posed=True)
    cut = CameraView(
        beside.camera, beside.depth_m, nothing, (beside.depth_m > 0).astype(np.uint16), nothing
    )
    found = silhouette(cut, 1, box((0.1, 0.1, 0.1), (0.3, 0.0, 0.05)))
    assert found.whole_px > found.mask.sum()
    assert found.box[0] + found.box[2] > 320


def test_openusd_reads_the_scene_with_its_grasps(
    run: RunFolder, scenes: list[ClutterScene], objects: dict[str, CatalogueObject]
) -> None:
    into = export_run(run, Format.USD, LEAST)
    scene = scenes[0]
    stage = Usd.Stage.Open(str(into / scene.split / f"{scene.scene_id}.usdc"))
    assert UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    prims = stage.GetPrimAtPath("/World/objects").GetChildren()
    assert len(prims) == len(scene.objects)
    for prim, placed in zip(prims, scene.objects, strict=True):
        points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(), dtype=np.float64)
        matrix = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
        world = np.c_[points, np.ones(len(points))] @ np.array(matrix)
        expected = objects[placed.object_name].mesh.transformed(placed.world_from_object)
        assert world[:, :3] == pytest.approx(expected.vertices_m, abs=1e-6)
    poses, quality = [], []
    for shard in listed_shards(run.artifact("grasps")):
        with open_artifact(shard) as artifact:
            for origin, found in read_grasps(artifact):
                if origin.scene_id == scene.scene_id:
                    poses.append(found.world_from_gripper)
                    quality.append(found.quality)
    instancer = UsdGeom.PointInstancer(stage.GetPrimAtPath("/World/grasps"))
    expected_poses = np.concatenate(poses)
    prim = instancer.GetPrim()
    exact = np.array(prim.GetAttribute("softgrip:world_from_gripper").Get())
    assert exact.transpose(0, 2, 1) == pytest.approx(expected_poses)
    primvar = UsdGeom.PrimvarsAPI(instancer).GetPrimvar("softgrip:quality")
    assert np.array(primvar.Get()) == pytest.approx(np.concatenate(quality), abs=1e-6)
    shown = instancer.ComputeInstanceTransformsAtTime(
        Usd.TimeCode.Default(), Usd.TimeCode.Default()
    )
    shown_poses = np.array([np.array(one) for one in shown]).transpose(0, 2, 1)
    assert shown_poses == pytest.approx(expected_poses, abs=2e-3)  # turns are half floats
