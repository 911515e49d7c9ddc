"""grasps.rrd: the pad draped on its object, the wrench against its limits, labels in all.

One step of the timeline a grasp, from the best to the worst. The close-up is in GCS (origin at
first touch, +z out along the approach), so that grasps can be compared by eye.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from jaxtyping import Float, Int

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.artifacts.sharding import read_index
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import invert
from pipeline.gripper import pad_of
from pipeline.gripper.pad import Pad
from pipeline.labelling.grasps import GraspOrigin, LabelledGrasps
from pipeline.labelling.shown_pads import SHOWN_SCENES
from pipeline.messages.grasps import pads_of, read_grasps
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_placed
from pipeline.recording import colours
from pipeline.recording.recording import (
    FinishedStage,
    eye_at,
    name_curve,
    recording,
    set_step,
    start_path,
    time_panel,
)
from pipeline.recording.shapes import shown_mesh, shown_pose
from pipeline.spread import choose_evenly
from pipeline.world.scene import PlacedObject
from schemas.softgrip.v1.grasps_pb2 import DrapedPads

TIMELINE = "grasp"
FULL_PRESSURE = 1.1  # p w_j of a full seal where w_j is greatest, with sigma_W of Eq. (13)
VIEW = f"Pad by p w_j (dark 0, yellow {FULL_PRESSURE}; red: lifted), wrench, cloud; in GCS"
LIFTED = colours.PALETTE[5]
LIFT_M = 3e-4  # the pad is drawn so far above what it lies on, as that is drawn simplified
ARROW_M = 0.04  # a full seal's force is drawn this long
ARROW_Z = (235, 235, 235)  # the axis of the gripper is drawn pale
LOADS = ("F_x", "F_y", "F_z", "T_z")
NEAR_M = 0.12  # other objects are drawn when this near

Steps = Sequence[rr.TimeColumn]


@dataclass(frozen=True)
class ShownGrasp:
    """One grasp of the recording.

    Attributes
    ----------
    placed
        Objects of its scene.
    origin
        Scene and camera that the grasp comes from.
    grasps
        The batch of labelled grasps that holds it.
    row
        Its row in the batch.
    pad_height_m
        Height of the draped pad's vertices, z in GCS at first touch [m], shape (v,).
    pad_pressure
        p w_j of each triangle, as in `triangle_pressure`, shape (t,).
    """

    placed: Sequence[PlacedObject]
    origin: GraspOrigin
    grasps: LabelledGrasps
    row: int
    pad_height_m: Float[np.ndarray, " v"]
    pad_pressure: Float[np.ndarray, " t"]


def draw_grasps(stage: FinishedStage, figures: Mapping[str, Any]) -> None:
    """Draw the recording from the finished shards that hold draped pads."""
    objects = read_objects(stage.upstream("objects"))
    meshes = {name: item.mesh for name, (item, _) in objects.items()}
    index = read_index(stage.output)
    shown: list[ShownGrasp] = []
    for scene in choose_evenly(len(index.shards), SHOWN_SCENES):
        placed = read_placed(stage.upstream("scenes"), scene)
        shown += shown_grasps(placed, stage.output.parent / index.shards[scene].path)
    with recording(stage, blueprint()) as stream:
        histogram = from_tensor(index.quality_histogram)
        ordered = sorted(shown, key=lambda one: -one.grasps.quality[one.row])
        show_grasps(stream, ordered, meshes, pad_of(stage.config.gripper.pad), histogram)


def shown_grasps(placed: tuple[PlacedObject, ...], shard: Path) -> list[ShownGrasp]:
    """The grasps of a shard that have their pads in it."""
    with open_artifact(shard) as artifact:
        batches = list(read_grasps(artifact))
        if not batches:
            return []
        pads = pads_of(artifact.one(DrapedPads))
    rows = [(origin, batch, row) for origin, batch in batches for row in range(len(batch))]
    shown = []
    for number, height_m, pressure in zip(pads.grasp, pads.height_m, pads.pressure, strict=True):
        origin, grasps, row = rows[number]
        shown.append(ShownGrasp(placed, origin, grasps, row, height_m, pressure))
    return shown


def blueprint(order: str = "best to worst", counted: str = "All labels") -> rrb.Blueprint:
    """Opens on the first grasp: the pad on its object beside figures and limits.

    Parameters
    ----------
    order
        In which order they are shown, in words.
    counted
        What the histogram counts, in words.

    Returns
    -------
    The blueprint.
    """
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(
                origin="/world",
                name=VIEW,
                eye_controls=eye_at((-0.09, -0.13, 0.11), (0.0, 0.0, -0.01)),
            ),
            rrb.Vertical(
                rrb.TextDocumentView(origin="/notes/grasp", name="Grasp"),
                rrb.BarChartView(
                    origin="/curves/limits", name="Share used of the limits of F_x, F_y, F_z, T_z"
                ),
                rrb.TimeSeriesView(origin="/curves/label", name=f"q and p, {order}"),
                rrb.BarChartView(origin="/curves/quality", name=f"{counted}, q in tenths"),
                row_shares=[3, 2, 2, 2],
            ),
            column_shares=[3, 2],
        ),
        time_panel(TIMELINE),
        collapse_panels=True,
    )


def show_grasps(
    stream: rr.RecordingStream,
    ordered: Sequence[ShownGrasp],
    meshes: Mapping[str, Mesh],
    pad: Pad,
    histogram: Int[np.ndarray, " tenths"],
) -> None:
    """Log the grasps in the order given; ``histogram`` counts q in tenths."""
    stream.log("curves/quality", rr.BarChart(histogram), static=True)
    name_curve(stream, "curves/label/q", "q", colours.PALETTE[2])
    name_curve(stream, "curves/label/p", "p", colours.PALETTE[1])
    names = {placed.object_name for shown in ordered for placed in shown.placed}
    corners = {name: meshes[name].vertices_m for name in names}
    boxes = {name: np.array([v.min(axis=0), v.max(axis=0)]) for name, v in corners.items()}
    for number, shown in enumerate(ordered):
        set_step(stream, TIMELINE, number)
        objects = start_path(stream, "world/objects", number)
        _show_surroundings(stream, objects, shown, meshes, boxes)
        stream.log("curves/limits", rr.BarChart(_limits_used(shown)))
    steps = [rr.TimeColumn(TIMELINE, sequence=np.arange(len(ordered)))]
    _show_pads(stream, steps, ordered, pad)
    _show_clouds(stream, steps, ordered, pad)
    _show_wrenches(stream, steps, ordered)
    for name, values in (
        ("q", [shown.grasps.quality[shown.row] for shown in ordered]),
        ("p", [shown.grasps.pressure[shown.row] for shown in ordered]),
    ):
        columns = rr.Scalars.columns(scalars=values)
        stream.send_columns(f"curves/label/{name}", indexes=steps, columns=columns)
    facts = rr.TextDocument.columns(
        text=[_facts(shown) for shown in ordered],
        media_type=[rr.MediaType.MARKDOWN] * len(ordered),
    )
    stream.send_columns("notes/grasp", indexes=steps, columns=facts)


def _show_surroundings(
    stream: rr.RecordingStream,
    path: str,
    shown: ShownGrasp,
    meshes: Mapping[str, Mesh],
    boxes: Mapping[str, Float[np.ndarray, "2 3"]],
) -> None:
    """The target and its near neighbours, in GCS."""
    grasps, row = shown.grasps, shown.row
    gripper_from_world = invert(grasps.world_from_gripper[row])
    for placed in shown.placed:
        mesh = meshes[placed.object_name]
        gripper_from_object = gripper_from_world @ placed.world_from_object
        target = placed.body_id == grasps.body_id[row]
        if not target and _distance_m(boxes[placed.object_name], gripper_from_object) > NEAR_M:
            continue
        colour = colours.PALETTE[1] if target else colours.PALETTE[7]
        body = f"{path}/{placed.body_id:02d}"
        # Mesh and pose apart: the mesh is made ready once, however often it is shown.
        stream.log(body, shown_mesh(mesh, colour))
        stream.log(body, shown_pose(gripper_from_object))


def _distance_m(
    box_m: Float[np.ndarray, "2 3"], gripper_from_object: Float[np.ndarray, "4 4"]
) -> float:
    """From the pad's centre, which is the frame's origin, to an object's box in its own frame."""
    centre = invert(gripper_from_object)[:3, 3]
    return float(np.linalg.norm(centre - np.clip(centre, *box_m)))


def _show_pads(
    stream: rr.RecordingStream, steps: Steps, ordered: Sequence[ShownGrasp], pad: Pad
) -> None:
    """The draped pads by p w_j, the rest of them lifted."""
    height = np.array([shown.pad_height_m for shown in ordered]) + LIFT_M
    flat = np.broadcast_to(pad.vertices_xy_m, (*height.shape, 2))
    vertices = np.concatenate([flat, height[..., None]], axis=2).astype(np.float32)
    contact = np.array([shown.grasps.contact_mask[shown.row] for shown in ordered])
    pressure = np.array([shown.pad_pressure for shown in ordered])
    by_pressure = colours.by_value(pressure.ravel() / FULL_PRESSURE)
    sealing = contact[:, pad.triangles].all(axis=2).ravel()
    colour = np.where(sealing[:, None], by_pressure, LIFTED).astype(np.uint8)
    # A triangle in a colour of its own shares no vertex.
    columns = rr.Mesh3D.columns(
        vertex_positions=vertices[:, pad.triangles].reshape(-1, 3),
        vertex_colors=np.repeat(colour, 3, axis=0),
    )
    corners = [pad.triangles.size] * len(ordered)
    stream.send_columns("world/pad", indexes=steps, columns=columns.partition(corners))


def _show_clouds(
    stream: rr.RecordingStream, steps: Steps, ordered: Sequence[ShownGrasp], pad: Pad
) -> None:
    """What the camera measured around the contact."""
    clouds = []
    for shown in ordered:
        grasps, row = shown.grasps, shown.row
        points = grasps.cloud[row][grasps.cloud_mask[row]].astype(np.float32) * pad.radius_m
        points[:, 2] -= grasps.touch_height_m[row]
        clouds.append(points)
    columns = rr.Points3D.columns(positions=np.concatenate(clouds))
    counts = [len(points) for points in clouds]
    stream.send_columns("world/cloud", indexes=steps, columns=columns.partition(counts))
    look = rr.Points3D.from_fields(radii=5e-4, colors=colours.PALETTE[3])
    stream.log("world/cloud", look, static=True)


def _show_wrenches(stream: rr.RecordingStream, steps: Steps, ordered: Sequence[ShownGrasp]) -> None:
    """GW as two arrows; the vacuum pulls the object up, out along +z."""
    wrench = np.array([shown.grasps.wrench[shown.row] for shown in ordered])
    along_z, sideways = wrench[:, :3] * [0, 0, 1], wrench[:, :3] * [1, 1, 0]
    vectors = ARROW_M * np.stack([along_z, sideways], axis=1)
    columns = rr.Arrows3D.columns(vectors=vectors.reshape(-1, 3))
    stream.send_columns(
        "world/wrench", indexes=steps, columns=columns.partition([2] * len(ordered))
    )
    look = rr.Arrows3D.from_fields(
        origins=[[0, 0, 0.01]] * 2,
        colors=[ARROW_Z, colours.PALETTE[6]],
        labels=["F_z", "F_xy"],
        radii=6e-4,
    )
    stream.log("world/wrench", look, static=True)


def _limits_used(shown: ShownGrasp) -> Float[np.ndarray, " 4"]:
    """How much of each limit of Eq. (8)-(11) is used: 0 in its middle, 1 at a bound."""
    slack = shown.grasps.limit_slack[shown.row]
    upper, lower = slack[:4], slack[4:]
    width = np.maximum(upper + lower, 1e-12)
    return np.asarray(1.0 - 2.0 * np.minimum(upper, lower) / width)


def _facts(shown: ShownGrasp) -> str:
    """q, p, GW and where the grasp comes from."""
    origin, grasps, row = shown.origin, shown.grasps, shown.row
    loads = "".join(
        f"| {name} of GW, share of its limit | {value:+.3f}, {100 * share:.0f} % |\n"
        for name, value, share in zip(LOADS, grasps.wrench[row], _limits_used(shown), strict=True)
    )
    return (
        f"**q = {float(grasps.quality[row]):.3f}**, p = {float(grasps.pressure[row]):.3f}, "
        f"{origin.status_names[int(grasps.status[row])]} "
        f"in {int(grasps.iterations[row])} iterations\n\n"
        f"| | |\n|-|-|\n"
        f"| object | {origin.object_names[int(grasps.object_index[row])]} |\n"
        f"| scene | {origin.scene_id}, level {origin.level}, {origin.split} |\n"
        f"{loads}"
        f"| tilt off the normal | {np.degrees(float(grasps.tilt_rad[row])):.1f}° |\n"
        f"| proposed as | {origin.proposal_names[int(grasps.proposal[row])]} |\n"
    )
