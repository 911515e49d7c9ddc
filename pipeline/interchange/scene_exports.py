"""All scenes of a run in a format of scenes: BOP with COCO, and USD."""

from pathlib import Path

from pipeline.geometry.mesh import Mesh
from pipeline.interchange.bop import write_models, write_scene
from pipeline.interchange.reading import grasps_by_scene
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scenes, scene_count
from pipeline.progress import progress


def export_bop(objects: Path, scenes: Path, into: Path) -> int:
    """Write models, and a folder a scene by split.

    Parameters
    ----------
    objects
        Artifact of stage objects.
    scenes
        Artifact of stage scenes.
    into
        Folder of the export.

    Returns
    -------
    How many pictures were written.
    """
    meshes = _meshes(objects)
    numbers = write_models(into, meshes)
    found = progress(read_scenes(scenes), scene_count(scenes), "export: bop", "scene")
    return sum(
        write_scene(into / scene.split / f"{number:06d}", scene, meshes, numbers)
        for number, scene in enumerate(found)
    )


def export_usd(
    objects: Path, scenes: Path, grasps: Path, into: Path, radius_m: float, table_side_m: float
) -> int:
    """Write a file a scene by split, with its grasps from all viewpoints.

    Parameters
    ----------
    objects
        Artifact of stage objects.
    scenes
        Artifact of stage scenes.
    grasps
        Artifact of stage grasps (its index).
    into
        Folder of the export.
    radius_m
        r_G, the radius that pads are drawn with [m].
    table_side_m
        Side of the table [m].

    Returns
    -------
    How many scenes were written.
    """
    from pipeline.interchange.usd_scenes import SUFFIX, write_usd  # usd-core is an extra

    meshes, by_scene = _meshes(objects), grasps_by_scene(grasps)
    count = scene_count(scenes)
    for scene in progress(read_scenes(scenes), count, "export: usd", "scene"):
        path = into / scene.split / f"{scene.scene_id}{SUFFIX}"
        write_usd(path, scene, meshes, by_scene.get(scene.scene_id), radius_m, table_side_m)
    return count


def _meshes(objects: Path) -> dict[str, Mesh]:
    return {name: item.mesh for name, (item, _) in read_objects(objects).items()}
