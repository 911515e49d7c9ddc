"""evaluate.rrd: a film of the attempts, failures first, with their wrench and what was decided."""

from collections.abc import Mapping, Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pipeline.artifacts.tensors import from_tensor
from pipeline.geometry.mesh import Mesh
from pipeline.recording import colours
from pipeline.recording.recording import looking, name_curve, numbered, step, time_panel
from pipeline.recording.shapes import shown_mesh, shown_pose
from schemas.softgrip.v1.evaluation_pb2 import Attempt

TIMELINE = "frame"
PAD_RADIUS_M = 0.025


def blueprint() -> rrb.Blueprint:
    """Opens on the first failure."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(
                origin="/world",
                name="Scene, pad and its path",
                eye_controls=looking((-0.6, -0.6, 0.5), (0.0, 0.0, 0.08)),
            ),
            rrb.Vertical(
                rrb.TextDocumentView(origin="/notes/attempt", name="Attempt"),
                rrb.TimeSeriesView(origin="/curves/force", name="load on the pad in N"),
                rrb.TimeSeriesView(origin="/curves/moment", name="moment on the pad in N m"),
                rrb.TextDocumentView(origin="/notes/result", name="Success by level"),
            ),
            column_shares=[3, 2],
        ),
        time_panel(TIMELINE),
        collapse_panels=True,
    )


def show_attempts(
    stream: rr.RecordingStream,
    attempts: Sequence[Attempt],
    names: Mapping[str, Sequence[str]],
    meshes: Mapping[str, Mesh],
    table: str,
) -> None:
    """Film the attempts one after the other; ``names`` are each scene's objects by body id."""
    stream.log(
        "notes/result", rr.TextDocument(table, media_type=rr.MediaType.MARKDOWN), static=True
    )
    for quantity, unit in (("force", "N"), ("moment", "N m")):
        for axis, hue in (("x", 5), ("y", 2), ("z", 1)):
            curve, label = f"curves/{quantity}/{axis}", f"{axis} in {unit}"
            name_curve(stream, curve, label, colours.PALETTE[hue])
    frame = 0
    films = sorted(attempts, key=lambda a: (a.outcome == "lifted", a.scene_id, a.attempt))
    for number, made in enumerate(films):
        step(stream, TIMELINE, frame)
        objects = numbered(stream, "world/objects", number)
        for index, name in enumerate(names[made.scene_id]):
            colour = colours.by_index(index + 1)
            stream.log(f"{objects}/{index + 1:02d}", shown_mesh(meshes[name], colour))
        stream.log("notes/attempt", rr.TextDocument(_facts(made)))
        path, bodies = from_tensor(made.gripper_path), from_tensor(made.object_paths)
        wrench = from_tensor(made.base_wrench)
        if len(path):
            stream.log("world/path", rr.LineStrips3D([path[:, :3, 3]], radii=0.001))
        for index in range(len(path)):
            step(stream, TIMELINE, frame)
            frame += 1
            _show_frame(stream, objects, path[index], bodies[index], wrench[index])


def _show_frame(
    stream: rr.RecordingStream,
    objects: str,
    pose: np.ndarray,
    bodies: np.ndarray,
    wrench: np.ndarray,
) -> None:
    for index, body in enumerate(bodies):
        path = f"{objects}/{index + 1:02d}"
        if np.isfinite(body).all():
            stream.log(path, shown_pose(body))
        else:
            stream.log(path, rr.Clear(recursive=True))
    stream.log(
        "world/pad",
        rr.Cylinders3D(
            lengths=[0.004], radii=[PAD_RADIUS_M], colors=[colours.PALETTE[6]], fill_mode="solid"
        ),
    )
    stream.log("world/pad", shown_pose(pose))
    for name, value in zip(("x", "y", "z"), wrench[:3], strict=True):
        stream.log(f"curves/force/{name}", rr.Scalars(value))
    for name, value in zip(("x", "y", "z"), wrench[3:], strict=True):
        stream.log(f"curves/moment/{name}", rr.Scalars(value))


def _facts(made: Attempt) -> str:
    return (
        f"{made.scene_id}, attempt {made.attempt}: {made.outcome} {made.cause}\n\n"
        f"target {made.target or 'none'}, {made.candidates} candidates, "
        f"predicted q {made.predicted_quality:.3f}\n\n"
        f"reached q {made.reached_quality:.3f}, p {made.seal_pressure:.3f}, "
        f"lifted {1e3 * made.lifted_height_m:.0f} mm"
    )
