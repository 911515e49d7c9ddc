"""referee.rrd: grasps that label and referee see differently, as the referee sees them.

One step of the timeline a grasp. All is in GCS: the object, and over it the pad's face coloured by
the vacuum under it, with arrows for what pulls, what is borne and what the object weighs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from jaxtyping import Float

from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import invert
from pipeline.recording import colours
from pipeline.recording.pads import show_pad, show_rings
from pipeline.recording.recording import eye_at, set_step, start_path, time_panel
from pipeline.recording.shapes import shown_mesh, shown_pose
from pipeline.referee.disc import Disc
from pipeline.referee.seal import GRAVITY_M_S2, Seal

TIMELINE = "grasp"
ARROW_M_PER_N = 0.003  # a closed fan on the whole pad, some 24 N, is drawn as long as the view
NEAR_M = 0.15  # other objects are shown when their centres are this near
VIEW = "Pad by the vacuum under it (dark 0, yellow a closed fan's), load borne and weight; in GCS"


@dataclass(frozen=True, eq=False)
class ShownSeal:
    """One grasp of the recording.

    Attributes
    ----------
    meshes
        Mesh and gripper_from_object of the target, then of the objects near it.
    seal
        The referee's seal; None where the pad meets nothing.
    down
        Direction of gravity in GCS, shape (3,).
    borne_n
        Greatest weight at the object's centre of mass that the seal bears [N].
    weight_n
        Weight of the object [N].
    title
        Name of the object.
    scores
        Name of a score and its value for this grasp.
    """

    meshes: Sequence[tuple[Mesh, Float[np.ndarray, "4 4"]]]
    seal: Seal | None
    down: Float[np.ndarray, " 3"]
    borne_n: float
    weight_n: float
    title: str
    scores: Mapping[str, float]


def shown_seal(
    items: Sequence[CatalogueObject],
    world_from_objects: Sequence[Float[np.ndarray, "4 4"]],
    target: int,
    world_from_gripper: Float[np.ndarray, "4 4"],
    seal: Seal | None,
    borne_n: float,
    scores: Mapping[str, float],
) -> ShownSeal:
    """Collect what the recording shows of one grasp.

    Parameters
    ----------
    items
        Objects of the scene.
    world_from_objects
        Pose of each, shape (4, 4).
    target
        Index of the object that is grasped.
    world_from_gripper
        Pose of the gripper, shape (4, 4).
    seal
        The referee's seal; None where the pad meets nothing.
    borne_n
        Greatest weight that the seal bears [N].
    scores
        Name of a score and its value for this grasp.

    Returns
    -------
    The grasp with the objects near it.
    """
    gripper_from_world = invert(world_from_gripper)
    meshes = [
        (item.mesh, gripper_from_world @ pose)
        for item, pose in zip(items, world_from_objects, strict=True)
    ]
    first = meshes.pop(target)
    near = [found for found in meshes if np.linalg.norm(found[1][:3, 3]) < NEAR_M]
    return ShownSeal(
        meshes=[first, *near],
        seal=seal,
        down=-gripper_from_world[:3, 2],
        borne_n=borne_n,
        weight_n=GRAVITY_M_S2 * items[target].mass_kg,
        title=items[target].name,
        scores=scores,
    )


def blueprint() -> rrb.Blueprint:
    """Opens on the grasp that the label overrates most."""
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
                    origin="/curves/vacuum",
                    name="Vacuum under the face by ring [Pa]",
                ),
                rrb.BarChartView(
                    origin="/curves/gap", name="Gap by ring, centre to rim [mm], at most 5"
                ),
                row_shares=[3, 2, 2],
            ),
            column_shares=[3, 2],
        ),
        time_panel(TIMELINE),
        collapse_panels=True,
    )


def show_seals(
    stream: rr.RecordingStream, shown: Sequence[ShownSeal], disc: Disc, full_pa: float
) -> None:
    """Log the grasps in their order; ``full_pa`` is the vacuum of a closed fan."""
    for number, one in enumerate(shown):
        set_step(stream, TIMELINE, number)
        path = start_path(stream, "world/objects", number)
        for index, (mesh, pose) in enumerate(one.meshes):
            colour = colours.PALETTE[7 if index else 1]
            stream.log(f"{path}/{index:02d}", shown_mesh(mesh, colour))
            stream.log(f"{path}/{index:02d}", shown_pose(pose))
        pad = start_path(stream, "world/pad", number)
        if one.seal is not None:
            show_pad(stream, pad, one.seal, disc, full_pa)
            show_rings(stream, one.seal, disc)
        arrows = start_path(stream, "world/loads", number)
        stream.log(
            arrows,
            rr.Arrows3D(
                origins=[[0.03, 0, 0], [0.035, 0, 0]],
                vectors=[ARROW_M_PER_N * n * one.down for n in (one.borne_n, one.weight_n)],
                colors=[colours.PALETTE[3], colours.PALETTE[6]],
                labels=["borne", "weight"],
                radii=6e-4,
            ),
        )
        stream.log("notes/grasp", rr.TextDocument(_facts(one), media_type="text/markdown"))


def _facts(one: ShownSeal) -> str:
    """Scores, what is borne, and how the fan works."""
    rows = [(name, f"{value:.3f}") for name, value in one.scores.items()]
    rows += [("bears a weight of", f"{one.borne_n:.2f} N"), ("weighs", f"{one.weight_n:.2f} N")]
    if one.seal is not None:
        vacuum = one.seal.vacuum
        rows += [
            ("vacuum in the cushion", f"{vacuum.in_cushion_pa / 1e3:.1f} kPa"),
            ("flow of the fan", f"{vacuum.flow_m3_s * 1e3:.2f} l/s"),
            ("vacuum's force on the object", f"{one.seal.pull_n:.2f} N"),
            ("vertices that touch", f"{100 * one.seal.touches.mean():.0f} %"),
        ]
    table = "".join(f"| {name} | {value} |\n" for name, value in rows)
    return f"**{one.title}**\n\n| | |\n|-|-|\n{table}"
