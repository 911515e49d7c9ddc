"""grasps.rrd: the pad draped on its object, the wrench against its limits, labels in all.

One step of the timeline a grasp, from the best to the worst. The close-up is in GCS (origin at
first touch, +z out along the approach), so that grasps can be compared by eye.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from jaxtyping import Float

from pipeline.artifacts.grasp_messages import GraspOrigin, LabelledGrasps
from pipeline.clutter.scene import ClutterScene
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import invert
from pipeline.gripper.balancing import quality_histogram
from pipeline.gripper.pad import Pad
from pipeline.recording import colours
from pipeline.recording.recording import looking, name_curve, numbered, step, time_panel
from pipeline.recording.shapes import shown_mesh, shown_pose

TIMELINE = "grasp"
FULL_PRESSURE = 1.1  # p w_j of a full seal where w_j is greatest, with sigma_W of Eq. (13)
VIEW = f"Pad by p w_j (dark 0, yellow {FULL_PRESSURE}; red: lifted), wrench, cloud; in GCS"
LIFTED = colours.PALETTE[5]
LIFT_M = 3e-4  # the pad is drawn this much above what it lies on
ARROW_M = 0.04  # a full seal's force is drawn this long
LOADS = ("F_x", "F_y", "F_z", "T_z")
NEAR_M = 0.12  # other objects are drawn when this near


@dataclass(frozen=True)
class ShownGrasp:
    """One grasp of the recording.

    pad_height_m : draped pad, z in GCS at first touch.
    pad_pressure : p w_j of each triangle, as in `triangle_pressure`.
    """

    scene: ClutterScene
    origin: GraspOrigin
    grasps: LabelledGrasps
    row: int
    pad_height_m: Float[np.ndarray, " v"]
    pad_pressure: Float[np.ndarray, " t"]


def blueprint() -> rrb.Blueprint:
    """Opens on the best grasp: the pad on its object beside figures and limits."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(
                origin="/world",
                name=VIEW,
                eye_controls=looking((-0.09, -0.13, 0.11), (0.0, 0.0, -0.01)),
            ),
            rrb.Vertical(
                rrb.TextDocumentView(origin="/notes/grasp", name="Grasp"),
                rrb.BarChartView(
                    origin="/curves/limits", name="Share used of the limits of F_x, F_y, F_z, T_z"
                ),
                rrb.TimeSeriesView(origin="/curves/label", name="q and p, best to worst"),
                rrb.BarChartView(origin="/curves/quality", name="All labels, q in tenths"),
                row_shares=[3, 2, 2, 2],
            ),
            column_shares=[3, 2],
        ),
        time_panel(TIMELINE),
        collapse_panels=True,
    )


def show_grasps(
    stream: rr.RecordingStream,
    grasps: Sequence[ShownGrasp],
    meshes: Mapping[str, Mesh],
    pad: Pad,
    quality: Float[np.ndarray, " n"],
) -> None:
    """Log the grasps from the best to the worst; ``quality`` are the labels of all grasps."""
    stream.log("curves/quality", rr.BarChart(quality_histogram(quality)), static=True)
    name_curve(stream, "curves/label/q", "q", colours.PALETTE[2])
    name_curve(stream, "curves/label/p", "p", colours.PALETTE[1])
    ordered = sorted(grasps, key=lambda shown: -shown.grasps.quality[shown.row])
    for number, shown in enumerate(ordered):
        step(stream, TIMELINE, number)
        objects = numbered(stream, "world/objects", number)
        _show_surroundings(stream, objects, shown.scene, shown.grasps, shown.row, meshes)
        _show_pad(stream, shown, pad)
        _show_figures(stream, shown.origin, shown.grasps, shown.row)


def _show_surroundings(
    stream: rr.RecordingStream,
    path: str,
    scene: ClutterScene,
    grasps: LabelledGrasps,
    row: int,
    meshes: Mapping[str, Mesh],
) -> None:
    """The target and its near neighbours, in GCS."""
    gripper_from_world = invert(grasps.world_from_gripper[row])
    for placed in scene.objects:
        mesh = meshes[placed.object_name]
        gripper_from_object = gripper_from_world @ placed.world_from_object
        target = placed.body_id == grasps.body_id[row]
        # The frame's origin is the pad's centre.
        pad_centre = invert(gripper_from_object)[:3, 3]
        if not target and np.linalg.norm(mesh.vertices_m - pad_centre, axis=1).min() > NEAR_M:
            continue
        colour = colours.PALETTE[1] if target else colours.PALETTE[7]
        body = f"{path}/{placed.body_id:02d}"
        # Mesh and pose apart: the mesh is simplified once, however often it is shown.
        stream.log(body, shown_mesh(mesh, colour))
        stream.log(body, shown_pose(gripper_from_object))


def _show_pad(stream: rr.RecordingStream, shown: ShownGrasp, pad: Pad) -> None:
    """The draped pad by p w_j, the rest of it lifted; the cloud; the wrench."""
    grasps, row = shown.grasps, shown.row
    vertices = np.column_stack([pad.vertices_xy_m, shown.pad_height_m + LIFT_M])
    sealing = grasps.contact_mask[row][pad.triangles].all(axis=1)
    pressure = colours.by_value(shown.pad_pressure / FULL_PRESSURE)
    colour = np.where(sealing[:, None], pressure, LIFTED).astype(np.uint8)
    # A triangle in a colour of its own shares no vertex.
    stream.log(
        "world/pad",
        rr.Mesh3D(
            vertex_positions=vertices[pad.triangles].reshape(-1, 3),
            vertex_colors=np.repeat(colour, 3, axis=0),
        ),
    )
    seen = grasps.cloud_mask[row]
    points = grasps.cloud[row][seen].astype(np.float64) * pad.radius_m
    points[:, 2] -= grasps.touch_height_m[row]
    stream.log("world/cloud", rr.Points3D(points, radii=5e-4, colors=colours.PALETTE[3]))
    f_x, f_y, f_z, _ = grasps.wrench[row]
    # The vacuum pulls the object up, out along +z.
    stream.log(
        "world/wrench",
        rr.Arrows3D(
            origins=[[0, 0, 0.01]] * 2,
            vectors=ARROW_M * np.array([[0, 0, f_z], [f_x, f_y, 0]]),
            colors=[colours.PALETTE[4], colours.PALETTE[6]],
            labels=["F_z", "F_xy"],
            radii=6e-4,
        ),
    )


def _show_figures(
    stream: rr.RecordingStream, origin: GraspOrigin, grasps: LabelledGrasps, row: int
) -> None:
    """q, p, GW and how much of each limit is used."""
    quality, pressure = float(grasps.quality[row]), float(grasps.pressure[row])
    stream.log("curves/label/q", rr.Scalars(quality))
    stream.log("curves/label/p", rr.Scalars(pressure))
    slack = grasps.limit_slack[row]
    upper, lower = slack[:4], slack[4:]
    width = np.maximum(upper + lower, 1e-12)
    used = 1.0 - 2.0 * np.minimum(upper, lower) / width
    stream.log("curves/limits", rr.BarChart(used))
    loads = "".join(
        f"| {name} of GW, share of its limit | {value:+.3f}, {100 * share:.0f} % |\n"
        for name, value, share in zip(LOADS, grasps.wrench[row], used, strict=True)
    )
    stream.log(
        "notes/grasp",
        rr.TextDocument(
            f"**q = {quality:.3f}**, p = {pressure:.3f}, "
            f"{origin.status_names[int(grasps.status[row])]} "
            f"in {int(grasps.iterations[row])} iterations\n\n"
            f"| | |\n|-|-|\n"
            f"| object | {origin.object_names[int(grasps.object_index[row])]} |\n"
            f"| scene | {origin.scene_id}, level {origin.level}, {origin.split} |\n"
            f"{loads}"
            f"| tilt off the normal | {np.degrees(float(grasps.tilt_rad[row])):.1f}° |\n"
            f"| proposed as | {origin.proposal_names[int(grasps.proposal[row])]} |\n",
            media_type=rr.MediaType.MARKDOWN,
        ),
    )
