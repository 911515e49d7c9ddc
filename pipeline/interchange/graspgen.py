"""GraspGen's JSON (Murali et al., 2025): one file an object, and its lists of objects by split.

``object.file`` and ``object.scale``, ``grasps.transforms`` and, as true or false,
``grasps.object_in_gripper`` are what GraspGen reads; ``grasps.quality`` is ours beside them.
"""

import json
from collections.abc import Iterable
from pathlib import Path

from pipeline.artifacts.publishing import publish_bytes
from pipeline.interchange.object_grasps import ObjectGrasps, obj_text

# GraspGen trains on the first list and validates on the second; the third is ours.
LISTS = {"train": "train.txt", "val": "valid.txt", "test": "test.txt"}


def write_graspgen(folder: Path, grasps: ObjectGrasps, least_quality: float) -> Path:
    """Write ``objects/<name>.obj`` and ``grasps/<name>.json`` of one object.

    Parameters
    ----------
    folder
        Folder of the export.
    grasps
        All grasps of the object.
    least_quality
        Least q of a grasp that counts as a success.

    Returns
    -------
    The JSON file.
    """
    item = grasps.item
    mesh_file = f"{item.name}.obj"
    publish_bytes(folder / "objects" / mesh_file, obj_text(item.mesh).encode())
    record = {
        "object": {"file": mesh_file, "scale": 1.0},
        "grasps": {
            "transforms": grasps.object_from_base.tolist(),
            "object_in_gripper": grasps.successful(least_quality).tolist(),
            "quality": grasps.quality.tolist(),
        },
    }
    path = folder / "grasps" / f"{item.name}.json"
    publish_bytes(path, json.dumps(record).encode())
    return path


def write_lists(folder: Path, objects: Iterable[tuple[str, str]]) -> None:
    """Write the lists of objects of each split, as mesh files relative to ``objects``.

    Parameters
    ----------
    folder
        Folder of the export.
    objects
        (name, split) of each object.
    """
    pairs = sorted(objects)
    for split, name in LISTS.items():
        lines = "".join(f"{item}.obj\n" for item, own in pairs if own == split)
        publish_bytes(folder / "splits" / name, lines.encode())
