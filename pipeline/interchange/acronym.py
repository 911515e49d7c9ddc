"""ACRONYM's HDF5 (Eppner et al., 2021): one file an object, as ``acronym_tools`` reads it.

``object/file`` and ``object/scale``, ``grasps/transforms`` and, as 0 or 1,
``grasps/qualities/flex/object_in_gripper`` lie where its loaders look. What ACRONYM has no place
for is under ``grasps/qualities/softgrip``.
"""

from pathlib import Path

import h5py
import numpy as np

from pipeline.artifacts.publishing import publish_bytes, published
from pipeline.interchange.object_grasps import ObjectGrasps, obj_text

GRIPPER_TYPE = "soft_vacuum"


def write_acronym(
    folder: Path, grasps: ObjectGrasps, least_quality: float, friction: float
) -> Path:
    """Write ``meshes/<name>.obj`` and ``grasps/<name>_1.h5`` of one object.

    Parameters
    ----------
    folder
        Folder of the export.
    grasps
        All grasps of the object.
    least_quality
        Least q of a grasp that counts as a success.
    friction
        Of the object [1].

    Returns
    -------
    The HDF5 file.
    """
    item = grasps.item
    mesh_file = f"meshes/{item.name}.obj"
    publish_bytes(folder / mesh_file, obj_text(item.mesh).encode())
    path = folder / "grasps" / f"{item.name}_1.h5"
    with published(path) as scratch, h5py.File(scratch, "w") as file:
        file["object/file"] = mesh_file
        file["object/scale"] = 1.0  # the mesh is written at its final size
        file["object/com"] = item.centre_of_mass_m
        file["object/mass"] = item.mass_kg
        file["object/volume"] = item.volume_m3
        file["object/inertia"] = item.inertia_kg_m2
        file["object/density"] = item.density_kg_m3
        file["object/friction"] = friction
        file["gripper/type"] = GRIPPER_TYPE
        file["gripper/configuration"] = np.zeros(0)  # a pad has no joints
        file["grasps/transforms"] = grasps.object_from_base
        success = grasps.successful(least_quality).astype(np.int32)
        file["grasps/qualities/flex/object_in_gripper"] = success
        ours = file.create_group("grasps/qualities/softgrip")
        ours["quality"] = grasps.quality
        ours["pressure"] = grasps.pressure
        ours["wrench"] = grasps.wrench
        ours["level"] = grasps.level
        ours["scene"] = np.array(grasps.scene, dtype=object).astype(h5py.string_dtype())
        ours.attrs["split"] = grasps.split
        ours.attrs["least_quality_of_success"] = least_quality
    return path
