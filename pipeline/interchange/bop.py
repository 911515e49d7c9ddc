"""Scenes in BOP's layout (Hodan et al., 2018), with a COCO file a scene.

``models/obj_000001.ply`` with ``models_info.json``, and by split a folder a scene with ``rgb``,
``depth``, ``mask``, ``mask_visib``, ``scene_camera.json``, ``scene_gt.json``,
``scene_gt_info.json`` and ``scene_gt_coco.json``. BOP counts in millimetres and puts pixel
centres at whole numbers.
"""

import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from PIL import Image
from scipy.spatial import ConvexHull
from scipy.spatial.distance import pdist

from pipeline.artifacts.publishing import publish_bytes
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import invert
from pipeline.world.cameras import PIXEL_CENTRE_PX, PinholeCamera, pixel_rays, project
from pipeline.world.raycasting import RayScene
from pipeline.world.scene import ClutterScene, PlacedObject
from pipeline.world.view import CameraView

DEPTH_SCALE = 0.1  # millimetres a unit of the depth images: a tenth fits 6.5 m into 16 bits
MM = 1000.0  # millimetres a metre
NO_BOX = [-1, -1, -1, -1]  # BOP's box of nothing


@dataclass(frozen=True, eq=False)
class Silhouette:
    """Where an object is, and how much of that is seen.

    Attributes
    ----------
    mask
        Its pixels as if nothing stood before it, within the picture, shape (h, w).
    visible
        Its pixels that are seen, shape (h, w).
    whole_px
        Pixels of the whole silhouette, beyond the picture's edges too.
    box
        Column, row, width and height of the whole silhouette [px].
    """

    mask: Bool[np.ndarray, "h w"]
    visible: Bool[np.ndarray, "h w"]
    whole_px: int
    box: list[int]


def write_models(folder: Path, meshes: Mapping[str, Mesh]) -> dict[str, int]:
    """Write all models, and give each object its number.

    Parameters
    ----------
    folder
        Of the data set.
    meshes
        Name of an object → its surface in its own frame [m].

    Returns
    -------
    Name of an object → its number, from 1.
    """
    numbers = {name: number for number, name in enumerate(meshes, start=1)}
    info = {}
    for name, number in numbers.items():
        mesh = meshes[name].scaled(MM)
        publish_bytes(folder / "models" / f"obj_{number:06d}.ply", _ply(mesh))
        lower, size = mesh.vertices_m.min(axis=0), mesh.extents_m
        info[str(number)] = {
            "name": name,
            "diameter": _diameter(mesh.vertices_m),
            **{f"min_{axis}": float(lower[i]) for i, axis in enumerate("xyz")},
            **{f"size_{axis}": float(size[i]) for i, axis in enumerate("xyz")},
        }
    publish_bytes(folder / "models" / "models_info.json", _json(info))
    return numbers


def write_scene(
    folder: Path, scene: ClutterScene, meshes: Mapping[str, Mesh], numbers: Mapping[str, int]
) -> int:
    """Write one scene, a picture a camera.

    Parameters
    ----------
    folder
        Of the scene: ``<split>/<scene>``.
    scene
        The scene with its views.
    meshes
        Name of an object → its surface in its own frame [m].
    numbers
        Name of an object → its number in ``models``.

    Returns
    -------
    How many pictures were written.
    """
    posed = {
        placed.body_id: meshes[placed.object_name].transformed(placed.world_from_object)
        for placed in scene.objects
    }
    cameras, truth, info = {}, {}, {}
    coco: dict[str, list[Any]] = {"images": [], "annotations": [], "categories": []}
    coco["categories"] = [{"id": number, "name": name} for name, number in numbers.items()]
    for image, view in enumerate(scene.views):
        found = [
            silhouette(view, placed.body_id, posed[placed.body_id]) for placed in scene.objects
        ]
        cameras[str(image)] = _camera(view.camera)
        truth[str(image)] = [
            _pose(view.camera, placed, numbers[placed.object_name]) for placed in scene.objects
        ]
        info[str(image)] = [_info(one, view) for one in found]
        _write_pictures(folder, image, view, found)
        coco["images"].append(
            {
                "id": image,
                "file_name": f"rgb/{image:06d}.png",
                "width": view.camera.width_px,
                "height": view.camera.height_px,
            }
        )
        coco["annotations"] += [
            _annotation(one, 1 + len(coco["annotations"]) + index, image, truth[str(image)][index])
            for index, one in enumerate(found)
        ]
    for name, content in (
        ("scene_camera", cameras),
        ("scene_gt", truth),
        ("scene_gt_info", info),
        ("scene_gt_coco", coco),
    ):
        publish_bytes(folder / f"{name}.json", _json(content))
    return len(scene.views)


def silhouette(view: CameraView, body_id: int, posed: Mesh) -> Silhouette:
    """Cast rays at one object alone.

    Parameters
    ----------
    view
        A picture of the scene.
    body_id
        The object's value in the segmentation.
    posed
        Its surface in WCS [m].

    Returns
    -------
    Its silhouette; what the picture shows of it counts as part of it.
    """
    camera = view.camera
    shape = (camera.height_px, camera.width_px)
    visible = view.segmentation == body_id
    pixels, depth_m = project(camera, posed.vertices_m)
    if not (depth_m > 0).all():  # partly behind the camera: what is seen of it is all that counts
        return Silhouette(visible, visible, int(visible.sum()), _box(visible, 0, 0))
    left, top = np.floor(pixels.min(axis=0)).astype(int)
    right, bottom = np.ceil(pixels.max(axis=0)).astype(int)
    k = camera.intrinsics.copy()
    k[:2, 2] -= (left, top)
    window = replace(camera, width_px=int(right - left), height_px=int(bottom - top), intrinsics=k)
    everywhere = np.ones((window.height_px, window.width_px), dtype=bool)
    eye, rays = pixel_rays(window, everywhere)
    hits = RayScene([posed]).cast(np.broadcast_to(eye, rays.shape), rays)
    whole = (hits.body >= 0).reshape(everywhere.shape)
    mask = np.zeros(shape, dtype=bool)
    rows = slice(max(top, 0), min(bottom, shape[0]))
    columns = slice(max(left, 0), min(right, shape[1]))
    if rows.stop > rows.start and columns.stop > columns.start:
        mask[rows, columns] = whole[
            rows.start - top : rows.stop - top, columns.start - left : columns.stop - left
        ]
    added = visible & ~mask
    return Silhouette(
        mask | visible, visible, int(whole.sum() + added.sum()), _box(whole, int(left), int(top))
    )


def _write_pictures(
    folder: Path, image: int, view: CameraView, found: Sequence[Silhouette]
) -> None:
    publish_bytes(folder / "rgb" / f"{image:06d}.png", _png(view.colour))
    units = np.round(view.depth_m * MM / DEPTH_SCALE)
    depth = np.where(units <= np.iinfo(np.uint16).max, units, 0).astype(np.uint16)
    publish_bytes(folder / "depth" / f"{image:06d}.png", _png(depth))
    for index, one in enumerate(found):
        for kind, mask in (("mask", one.mask), ("mask_visib", one.visible)):
            picture = np.where(mask, 255, 0).astype(np.uint8)
            publish_bytes(folder / kind / f"{image:06d}_{index:06d}.png", _png(picture))


def _camera(camera: PinholeCamera) -> dict[str, Any]:
    k = camera.intrinsics.copy()
    k[:2, 2] -= PIXEL_CENTRE_PX
    camera_from_world = invert(camera.world_from_camera)
    return {
        "cam_K": k.ravel().tolist(),
        "depth_scale": DEPTH_SCALE,
        "cam_R_w2c": camera_from_world[:3, :3].ravel().tolist(),
        "cam_t_w2c": (MM * camera_from_world[:3, 3]).tolist(),
    }


def _pose(camera: PinholeCamera, placed: PlacedObject, number: int) -> dict[str, Any]:
    pose = invert(camera.world_from_camera) @ placed.world_from_object
    return {
        "cam_R_m2c": pose[:3, :3].ravel().tolist(),
        "cam_t_m2c": (MM * pose[:3, 3]).tolist(),
        "obj_id": number,
    }


def _info(one: Silhouette, view: CameraView) -> dict[str, Any]:
    seen = int(one.visible.sum())
    return {
        "bbox_obj": one.box,
        "bbox_visib": _box(one.visible, 0, 0),
        "px_count_all": one.whole_px,
        "px_count_valid": int((one.mask & (view.depth_m > 0)).sum()),
        "px_count_visib": seen,
        "visib_fract": seen / one.whole_px if one.whole_px else 0.0,
    }


def _annotation(
    one: Silhouette, number: int, image: int, truth: Mapping[str, Any]
) -> dict[str, Any]:
    """COCO's record of what is seen of an object; its mask in uncompressed run lengths."""
    flat = one.visible.ravel(order="F")
    changes = np.flatnonzero(np.diff(flat)) + 1
    runs = np.diff(np.concatenate([[0], changes, [len(flat)]])).tolist()
    return {
        "id": number,
        "image_id": image,
        "category_id": truth["obj_id"],
        "iscrowd": 0,
        "area": int(flat.sum()),
        "bbox": _box(one.visible, 0, 0),
        "segmentation": {
            "counts": [0, *runs] if flat[0] else runs,
            "size": list(one.visible.shape),
        },
    }


def _box(mask: Bool[np.ndarray, "h w"], left: int, top: int) -> list[int]:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if len(rows) == 0:
        return list(NO_BOX)
    return [
        int(columns[0] + left),
        int(rows[0] + top),
        int(columns[-1] - columns[0] + 1),
        int(rows[-1] - rows[0] + 1),
    ]


def _diameter(vertices: Float[np.ndarray, "n 3"]) -> float:
    """The largest distance between two vertices, both of which lie on the convex hull."""
    return float(pdist(vertices[ConvexHull(vertices).vertices]).max())


def _ply(mesh: Mesh) -> bytes:
    head = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(mesh.vertices_m)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.empty(len(mesh.faces), dtype=[("n", "u1"), ("at", "<i4", 3)])
    faces["n"], faces["at"] = 3, mesh.faces
    return head.encode() + mesh.vertices_m.astype("<f4").tobytes() + faces.tobytes()


def _png(picture: np.ndarray) -> bytes:
    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="PNG")
    return file.getvalue()


def _json(content: Any) -> bytes:
    return (json.dumps(content, indent=1) + "\n").encode()
