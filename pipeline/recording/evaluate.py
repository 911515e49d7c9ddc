"""evaluate.rrd: a film of the attempts with scene, robot, pictures and forces, worst failure first.

The worst failure is the failed attempt with the highest q-hat.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pipeline.artifacts import open_artifact, publish_bytes
from pipeline.artifacts.tensors import from_tensor
from pipeline.config import RunConfig
from pipeline.config.grasps import PadConfig
from pipeline.geometry.mesh import Mesh
from pipeline.messages.objects import read_objects
from pipeline.messages.proposed_contacts import worst_by_object
from pipeline.messages.scenes import read_placements
from pipeline.recording import colours
from pipeline.recording.pads import SealedPad, sealed_pad, show_pad, show_rings
from pipeline.recording.proposed_contacts import (
    WORST,
    WORST_EACH,
    errors_markdown,
    show_worst,
)
from pipeline.recording.recording import (
    FinishedStage,
    eye_at,
    name_curve,
    recording,
    set_step,
    start_path,
    time_panel,
)
from pipeline.recording.results import read_tables
from pipeline.recording.robot import (
    GRIPPER,
    ShownRobot,
    send_arm,
    send_poses,
    show_arm,
    show_free_pad,
    show_gripper,
)
from pipeline.recording.shapes import shown_mesh, shown_pose
from pipeline.referee.seal import Referee, referee_of
from pipeline.spread import choose_evenly
from schemas.softgrip.v1.evaluation_pb2 import Attempt, DepthPicture, ProposedContacts

TIMELINE = "frame"
SHOWN_CANDIDATES = 60  # the best of them: more hide the scene
APPROACH_M = 0.025  # length of the arrows that candidates are drawn as
CAMERAS = ("static_0", "wrist")
STATES = ("observe", "pregrasp", "approach", "seal", "lift", "shake", "transport", "done")


def draw_evaluate(stage: FinishedStage, figures: Mapping[str, Any]) -> None:
    """Draw the film and the table from the finished evaluation."""
    meshes = {
        name: item.mesh for name, (item, _) in read_objects(stage.upstream("objects")).items()
    }
    names = {
        scene_id: [placed.object_name for placed in objects]
        for scene_id, objects in read_placements(stage.upstream("scenes")).items()
    }
    with open_artifact(stage.output) as artifact:
        attempts = [message for _, message in artifact.messages(Attempt)]
        contacts = [message for _, message in artifact.messages(ProposedContacts)]
    ordered = worst_first(attempts)
    shown = [ordered[i] for i in choose_evenly(len(ordered), stage.config.recording.attempts)]
    text = read_tables(stage.output)
    scale = stage.config.gripper.pad.radius_m / PadConfig().radius_m
    view = blueprint(stage.config.evaluate.robot == "iiwa14", scale)
    pads = [sealed_pad(made, names[made.scene_id], meshes, stage.config) for made in shown]
    referee = referee_of(stage.config.referee, stage.config.gripper.pad.radius_m)
    with recording(stage, view) as stream:
        robot = shown_robot(stage.config)
        show_attempts(stream, shown, names, meshes, text, robot, pads, referee)
        if analysis := figures.get("error_analysis"):
            worst = worst_by_object(contacts, stage.config.evaluate.split, WORST_EACH)
            show_worst(stream, worst, list(analysis["by_object"]))
            errors = errors_markdown(analysis)
            note = rr.TextDocument(errors, media_type=rr.MediaType.MARKDOWN)
            stream.log("notes/errors", note, static=True)
            text = f"{text}\n{errors}"
    publish_bytes(stage.output.with_suffix(".md"), text.encode())


def shown_robot(config: RunConfig) -> ShownRobot:
    """Sizes of the robot that the film shows."""
    return ShownRobot(config.gripper.pad.radius_m, config.evaluate.hand, config.evaluate.arm)


def blueprint(with_arm: bool = False, scale: float = 1.0) -> rrb.Blueprint:
    """Opens on the worst failure; where an arm reaches in, from beside it.

    Parameters
    ----------
    with_arm
        Whether an arm moves the gripper.
    scale
        Of the pad against Table I's; without effect where an arm sets the view.

    Returns
    -------
    How the viewer lays the recording out.
    """
    eye_m = (0.5, -1.05, 0.8) if with_arm else (-0.55 * scale, -0.55 * scale, 0.5 * scale)
    target_m = (-0.2, 0.0, 0.25) if with_arm else (0.0, 0.0, 0.08 * scale)
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Tabs(
                rrb.Spatial3DView(
                    origin="/world",
                    contents=["+ /world/**", f"- /{WORST}/**"],
                    name="Scene, gripper and its path, candidates by q-hat",
                    eye_controls=eye_at(eye_m, target_m),
                ),
                rrb.Spatial3DView(
                    origin=f"/{WORST}",
                    name="Worst objects, a row each: clouds with and without noise, units of r_G",
                    eye_controls=eye_at((7.5, -18.0, 12.0), (7.5, -4.5, 0.0)),
                ),
            ),
            rrb.Vertical(
                rrb.TextDocumentView(origin="/notes/attempt", name="Attempt"),
                rrb.Horizontal(
                    *(
                        rrb.Spatial2DView(origin=f"/camera/{name}", name=f"depth, {name}")
                        for name in CAMERAS
                    )
                ),
                rrb.TimeSeriesView(origin="/curves/force", name="force at the base in N"),
                rrb.TimeSeriesView(origin="/curves/moment", name="moment at the base in N m"),
                rrb.Tabs(
                    rrb.TextDocumentView(origin="/notes/result", name="Success"),
                    rrb.TextDocumentView(origin="/notes/errors", name="Errors"),
                    rrb.TimeSeriesView(origin="/curves/load", name="Load and what is borne in N"),
                    rrb.BarChartView(origin="/curves/vacuum", name="Vacuum by ring in Pa"),
                    rrb.BarChartView(origin="/curves/gap", name="Gap by ring in mm, at most 5"),
                    rrb.TimeSeriesView(origin="/curves/state", name="State of the policy"),
                ),
                row_shares=[2, 3, 2, 2, 2],
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
    robot: ShownRobot,
    pads: Sequence[SealedPad | None] = (),
    referee: Referee | None = None,
) -> None:
    """Log the attempts one after the other as a film.

    Parameters
    ----------
    stream
        The recording.
    attempts
        Attempts in the order of the film.
    names
        Names of each scene's objects, in the order of their body ids, by scene id.
    meshes
        Mesh of each object by its name.
    table
        The results as Markdown.
    robot
        Sizes of the robot.
    pads
        The sealed pad of each attempt, or None; none at all where nothing knows them.
    referee
        The pad's elements, and the fan; needed where there are sealed pads.
    """
    stream.log(
        "notes/result", rr.TextDocument(table, media_type=rr.MediaType.MARKDOWN), static=True
    )
    for quantity, unit in (("force", "N"), ("moment", "N m")):
        for axis, hue in (("x", 5), ("y", 2), ("z", 1)):
            curve, label = f"curves/{quantity}/{axis}", f"{axis} in {unit}"
            name_curve(stream, curve, label, colours.PALETTE[hue])
    name_curve(stream, "curves/state", ", ".join(STATES), colours.PALETTE[4])
    name_curve(stream, "curves/load/hangs", "hangs on the pad in N", colours.PALETTE[6])
    name_curve(stream, "curves/load/borne", "weight borne in N", colours.PALETTE[3])
    frame = 0
    set_step(stream, TIMELINE, frame)
    show_gripper(stream, robot)
    if any(made.HasField("joint_path") for made in attempts):
        show_arm(stream)
    for number, made in enumerate(attempts):
        set_step(stream, TIMELINE, frame)
        show_free_pad(stream, robot)
        objects = start_path(stream, "world/objects", number)
        for index, name in enumerate(names[made.scene_id]):
            colour = colours.by_index(index + 1)
            stream.log(f"{objects}/{index + 1:02d}", shown_mesh(meshes[name], colour))
        stream.log("notes/attempt", rr.TextDocument(_facts(made), media_type=rr.MediaType.MARKDOWN))
        _show_choice(stream, made)
        path = from_tensor(made.gripper_path)
        if len(path):
            stream.log("world/path", rr.LineStrips3D([path[:, :3, 3]], radii=0.001))
            _show_motion(stream, objects, made, frame)
            if number < len(pads) and referee is not None:
                _show_seal(stream, number, made, pads[number], referee, frame)
            if made.HasField("joint_path"):
                frames = frame + np.arange(len(path))
                send_arm(stream, TIMELINE, frames, from_tensor(made.joint_path), robot)
        frame += len(path)


def _show_seal(
    stream: rr.RecordingStream,
    number: int,
    made: Attempt,
    pad: SealedPad | None,
    referee: Referee,
    first: int,
) -> None:
    """From the last seal on: the pad as it lies, and what hangs on it beside what it bears."""
    set_step(stream, TIMELINE, first)
    path = start_path(stream, f"{GRIPPER}/sealed", number)
    if pad is None:
        return
    set_step(stream, TIMELINE, first + pad.step)
    stream.log(f"{GRIPPER}/pad", rr.Clear(recursive=True))
    show_pad(stream, path, pad.seal, referee.disc, referee.fan.vacuum_pa)
    show_rings(stream, pad.seal, referee.disc)
    poses, wrench = from_tensor(made.gripper_path), from_tensor(made.base_wrench)
    hangs_n = -np.einsum("tj,tj->t", poses[pad.step :, 2, :3], wrench[pad.step :, :3])
    frames = first + np.arange(pad.step, len(poses))
    for name, values in (("hangs", hangs_n), ("borne", np.full(len(frames), made.borne_n))):
        stream.send_columns(
            f"curves/load/{name}",
            indexes=[rr.TimeColumn(TIMELINE, sequence=frames)],
            columns=rr.Scalars.columns(scalars=values),
        )


def worst_first(attempts: Sequence[Attempt]) -> list[Attempt]:
    """Failures by falling q-hat, then the others in their order."""
    return sorted(
        attempts,
        key=lambda a: (
            a.outcome == "lifted",
            0.0 if a.outcome == "lifted" else -a.predicted_quality,
            a.scene_id,
            a.policy,
            a.attempt,
        ),
    )


def _show_choice(stream: rr.RecordingStream, made: Attempt) -> None:
    """Candidates as arrows coloured by q-hat, the pose chosen, and the pictures behind it."""
    poses, quality = from_tensor(made.candidate_poses), from_tensor(made.candidate_quality)
    best = np.argsort(-quality, kind="stable")[:SHOWN_CANDIDATES]
    stream.log(
        "world/candidates",
        rr.Arrows3D(
            origins=poses[best, :3, 3] + APPROACH_M * poses[best, :3, 2],
            vectors=-APPROACH_M * poses[best, :3, 2],
            colors=colours.by_value(quality[best]),
            radii=0.0008,
        ),
    )
    chosen = from_tensor(made.world_from_gripper)
    stream.log("world/chosen", shown_pose(chosen))
    stream.log("world/chosen", rr.TransformAxes3D(0.05))
    for camera in CAMERAS:
        pictures = [p for p in made.pictures if p.camera == camera]
        if pictures:
            _show_picture(stream, f"camera/{camera}", pictures[-1])
        else:
            stream.log(f"camera/{camera}", rr.Clear(recursive=True))


def _show_picture(stream: rr.RecordingStream, path: str, picture: DepthPicture) -> None:
    depth = from_tensor(picture.depth_mm)
    seen = depth[depth > 0]
    reach = (float(seen.min()), float(seen.max())) if seen.size else (0.0, 1.0)
    stream.log(path, rr.DepthImage(depth, meter=1000.0, depth_range=reach, colormap="viridis"))


def _show_motion(stream: rr.RecordingStream, objects: str, made: Attempt, first: int) -> None:
    """Every frame of an attempt, from frame ``first``: poses, wrench and the policy's state."""
    path, bodies = from_tensor(made.gripper_path), from_tensor(made.object_paths)
    frames = first + np.arange(len(path))
    there = np.isfinite(bodies).all(axis=(2, 3))
    for index in range(bodies.shape[1]):
        body = f"{objects}/{index + 1:02d}"
        gone = np.flatnonzero(~there[:, index])
        until = int(gone[0]) if gone.size else len(path)
        send_poses(stream, TIMELINE, body, frames[:until], bodies[:until, index])
        if gone.size:
            set_step(stream, TIMELINE, int(frames[until]))
            stream.log(body, rr.Clear(recursive=True))
    send_poses(stream, TIMELINE, GRIPPER, frames, path)
    wrench = from_tensor(made.base_wrench)
    curves = [f"{quantity}/{axis}" for quantity in ("force", "moment") for axis in "xyz"]
    states = [STATES.index(state) for state in made.states]
    for curve, values in [*zip(curves, wrench.T, strict=True), ("state", states)]:
        stream.send_columns(
            f"curves/{curve}",
            indexes=[rr.TimeColumn(TIMELINE, sequence=frames)],
            columns=rr.Scalars.columns(scalars=values),
        )


def _facts(made: Attempt) -> str:
    return (
        f"**{made.policy}: {made.outcome}{': ' + made.cause if made.cause else ''}** "
        f"({made.scene_id}, attempt {made.attempt})\n\n"
        f"target {made.target or 'none'}; {made.candidates} candidates, "
        f"{made.corrections} corrections, {made.seals} seals; "
        f"predicted q {made.predicted_quality:.3f}, "
        f"reached q {made.reached_quality:.3f}, seal {made.seal_pressure:.3f}; "
        f"bears {made.borne_n:.2f} N, weighs {made.weight_n:.2f} N; "
        f"lifted {1e3 * made.lifted_height_m:.0f} mm in {made.duration_s:.1f} s, "
        f"carried at up to {made.carried_m_s2:g} m/s²{_ceiling(made)}\n"
    )


def _ceiling(made: Attempt) -> str:
    """What the best pose bears of the target as it lay."""
    if not made.HasField("ceilings_n") or not made.target_body:
        return ""
    borne_n = from_tensor(made.ceilings_n)[made.target_body - 1, 0]
    return f"; the best pose bears {borne_n:.2f} N"
