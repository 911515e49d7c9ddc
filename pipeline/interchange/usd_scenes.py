"""A scene with its grasps as USD (OpenUSD's own library), for viewers and simulators.

Metres, z up. ``/World/objects/<name>_<body>`` are meshes at their poses, ``/World/table`` is the
table's top, ``/World/grasps`` is a point instancer of pads, +z out of the object, with q and p of
each as primvars and its exact pose as a matrix.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, Vt

from pipeline.artifacts.publishing import scratch_beside
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import position_quaternion
from pipeline.interchange.object_grasps import PlacedGrasps
from pipeline.world.scene import ClutterScene

SUFFIX = ".usdc"
PAD_HEIGHT_M = 0.002  # a pad is drawn as a disc so thick


def write_usd(
    path: Path,
    scene: ClutterScene,
    meshes: Mapping[str, Mesh],
    grasps: PlacedGrasps | None,
    radius_m: float,
    table_side_m: float,
) -> None:
    """Write one scene.

    Parameters
    ----------
    path
        The file, its name ends in `SUFFIX`.
    scene
        What lies where.
    meshes
        Name of an object → its surface in its own frame [m].
    grasps
        Labelled grasps of the scene; None where it has none.
    radius_m
        r_G, the radius that pads are drawn with [m].
    table_side_m
        Side of the table [m].
    """
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    world = UsdGeom.Xform.Define(stage, "/World")
    stage.SetDefaultPrim(world.GetPrim())
    world.GetPrim().SetCustomDataByKey("softgrip:scene", scene.scene_id)
    world.GetPrim().SetCustomDataByKey("softgrip:level", scene.level)
    half = table_side_m / 2
    corners = np.array([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)])
    _mesh(stage, "/World/table", Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]])))
    UsdGeom.Xform.Define(stage, "/World/objects")
    for placed in scene.objects:
        name = Tf.MakeValidIdentifier(f"{placed.object_name}_{placed.body_id}")
        prim = _mesh(stage, f"/World/objects/{name}", meshes[placed.object_name])
        prim.AddTransformOp().Set(_matrix(placed.world_from_object))
        prim.GetPrim().SetCustomDataByKey("softgrip:object", placed.object_name)
    if grasps is not None:
        _instancer(stage, grasps, radius_m)
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = scratch_beside(path)
    # The library tells the format by the ending.
    written = scratch.with_name(scratch.name + SUFFIX)
    stage.GetRootLayer().Export(str(written))
    written.replace(path)


def _mesh(stage: Usd.Stage, path: str, mesh: Mesh) -> UsdGeom.Mesh:
    prim = UsdGeom.Mesh.Define(stage, path)
    prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(mesh.vertices_m.astype(np.float32)))
    prim.CreateFaceVertexIndicesAttr(_integers(mesh.faces.ravel()))
    prim.CreateFaceVertexCountsAttr(_integers(np.full(len(mesh.faces), 3)))
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    return prim


def _instancer(stage: Usd.Stage, grasps: PlacedGrasps, radius_m: float) -> None:
    poses = grasps.world_from_gripper
    instancer = UsdGeom.PointInstancer.Define(stage, "/World/grasps")
    pad = UsdGeom.Cylinder.Define(stage, "/World/grasps/pad")
    pad.CreateRadiusAttr(radius_m)
    pad.CreateHeightAttr(PAD_HEIGHT_M)
    pad.CreateAxisAttr(UsdGeom.Tokens.z)
    instancer.CreatePrototypesRel().SetTargets([pad.GetPath()])
    instancer.CreateProtoIndicesAttr(_integers(np.zeros(len(poses))))
    places = poses[:, :3, 3].astype(np.float32)
    instancer.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(places))
    turned = [position_quaternion(pose)[1] for pose in poses]
    instancer.CreateOrientationsAttr([Gf.Quath(*map(float, q)) for q in turned])
    of_each = UsdGeom.PrimvarsAPI(instancer)
    for name, values in (("quality", grasps.quality), ("pressure", grasps.pressure)):
        primvar = of_each.CreatePrimvar(
            f"softgrip:{name}", Sdf.ValueTypeNames.FloatArray, UsdGeom.Tokens.varying
        )
        primvar.Set(Vt.FloatArray.FromNumpy(np.asarray(values, dtype=np.float32)))
    prim = instancer.GetPrim()
    bodies = prim.CreateAttribute("softgrip:body", Sdf.ValueTypeNames.IntArray)
    bodies.Set(_integers(grasps.body_id))
    exact = prim.CreateAttribute("softgrip:world_from_gripper", Sdf.ValueTypeNames.Matrix4dArray)
    exact.Set([_matrix(pose) for pose in poses])


def _matrix(pose: Float[np.ndarray, "4 4"]) -> Gf.Matrix4d:
    """A pose as USD has it: points are rows, so the matrix is transposed."""
    return Gf.Matrix4d(*map(float, pose.T.ravel()))


def _integers(values: Int[np.ndarray, " n"] | Float[np.ndarray, " n"]) -> Vt.IntArray:
    return Vt.IntArray.FromNumpy(np.asarray(values, dtype=np.int32))
