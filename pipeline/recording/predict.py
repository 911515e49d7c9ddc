"""predict.rrd: the measured scene with its support, and the grasps proposed on it."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pipeline.camera.prediction import Prediction
from pipeline.camera.proposals import pixels_of
from pipeline.geometry.transforms import invert, transform_points
from pipeline.recording import colours
from pipeline.recording.overlay import depth_picture
from pipeline.recording.recording import eye_at, set_step, time_panel
from pipeline.recording.shapes import shown_pose
from pipeline.world.cameras import points_of_depth

TIMELINE = "grasp"
CLOUD_EVERY = 2  # every second pixel a side: a quarter of the points
FRUSTUM_M = 0.1  # a camera is drawn this long
_RIM = 48  # points of a pad's outline


def blueprint(prediction: Prediction) -> rrb.Blueprint:
    """Opens on the scene in 3-D; beside it the pictures and the table of grasps."""
    cameras = [frame.camera.name for frame in prediction.frames]
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(
                origin="/",
                contents=[
                    "/world/**",
                    *(
                        f"- /world/{name}/{kind}"
                        for name in cameras
                        for kind in ("depth", "grasps")
                    ),
                ],
                name="Measured points and pads by q-hat, z up",
                eye_controls=_eye(prediction),
            ),
            rrb.Vertical(
                *(
                    rrb.Spatial2DView(
                        origin=f"/world/{name}",
                        contents=[f"/world/{name}/colour", f"/world/{name}/grasps"],
                        name=name,
                    )
                    for name in cameras[:2]
                ),
                rrb.TextDocumentView(origin="/notes/grasps", name="Grasps, the best first"),
            ),
            column_shares=[3, 2],
        ),
        time_panel(TIMELINE),
        collapse_panels=True,
    )


def show_prediction(stream: rr.RecordingStream, prediction: Prediction) -> None:
    """Pictures and all pads; each step of the timeline shows one grasp alone, the best first."""
    proposals = prediction.proposals
    stream.log("world", shown_pose(_level_from_world(prediction)), static=True)
    rims = _rims(prediction)
    shown = colours.by_value(proposals.quality)
    for frame in prediction.frames:
        camera = frame.camera
        path = f"world/{camera.name}"
        stream.log(path, shown_pose(camera.world_from_camera), static=True)
        stream.log(
            path,
            rr.Pinhole(
                image_from_camera=camera.intrinsics,
                resolution=[camera.width_px, camera.height_px],
                camera_xyz=rr.ViewCoordinates.RDF,
                image_plane_distance=FRUSTUM_M,
            ),
            static=True,
        )
        picture = frame.colour if frame.colour is not None else depth_picture(frame.depth_m)
        stream.log(f"{path}/colour", rr.Image(picture).compress(jpeg_quality=90), static=True)
        depth = rr.DepthImage(frame.depth_m.astype(np.float32), meter=1.0)
        stream.log(f"{path}/depth", depth, static=True)
        outlines = [pixels_of(frame, rim, within=False)[0] for rim in rims]
        stream.log(f"{path}/grasps", rr.LineStrips2D(outlines, colors=shown), static=True)
        points, rows, columns = points_of_depth(frame.depth_m, camera, CLOUD_EVERY)
        cloud = rr.Points3D(points, colors=picture[rows, columns], radii=0.001)
        stream.log(f"world/cloud/{camera.name}", cloud, static=True)
    stream.log("world/grasps/all", rr.LineStrips3D(rims, colors=shown, radii=0.0005), static=True)
    if proposals.support is not None and len(proposals.support.outline_m):
        corners = proposals.support.outline_m
        outline = np.column_stack([corners, np.zeros(len(corners))])
        pose = proposals.support.world_from_support
        stream.log("world/support", shown_pose(pose), static=True)
        closed = [np.vstack([outline, outline[:1]])]
        stream.log(
            "world/support/outline", rr.LineStrips3D(closed, colors=colours.PALETTE[7]), static=True
        )
    stream.log(
        "notes/grasps",
        rr.TextDocument(_table(prediction), media_type=rr.MediaType.MARKDOWN),
        static=True,
    )
    for index in range(len(proposals)):
        set_step(stream, TIMELINE, index)
        pose = proposals.world_from_contact[index]
        tip = pose[:3, 3] + 4.0 * prediction.radius_m * pose[:3, 2]
        stream.log(
            "world/grasps/one",
            rr.Arrows3D(
                origins=[tip], vectors=[pose[:3, 3] - tip], colors=shown[index : index + 1]
            ),
        )
        stream.log(
            "world/grasps/one/rim",
            rr.LineStrips3D([rims[index]], colors=shown[index : index + 1], radii=0.002),
        )


def _level_from_world(prediction: Prediction) -> np.ndarray:
    """The support's frame, in which z is up, or the frames' world where there is no support."""
    support = prediction.proposals.support
    return np.eye(4) if support is None else invert(support.world_from_support)


def _eye(prediction: Prediction) -> rrb.EyeControls3D:
    """Look at what the best grasps lie on, from beside the first camera and a little higher."""
    level = _level_from_world(prediction)
    camera = prediction.frames[0].camera
    poses = prediction.proposals.world_from_contact
    if len(poses):
        at = poses[:, :3, 3].mean(axis=0)
    else:
        points, _, _ = points_of_depth(prediction.frames[0].depth_m, camera, CLOUD_EVERY)
        at = points.mean(axis=0)
    target, eye = transform_points(level, np.stack([at, camera.world_from_camera[:3, 3]]))
    beside = np.cross(eye - target, (0.0, 0.0, 1.0))
    eye = eye + 0.4 * beside + np.array([0.0, 0.0, 0.2 * float(np.linalg.norm(eye - target))])
    x, y, z = (float(value) for value in eye)
    at_x, at_y, at_z = (float(value) for value in target)
    return eye_at((x, y, z), (at_x, at_y, at_z))


def _rims(prediction: Prediction) -> list[np.ndarray]:
    """Outline of every pad in the world."""
    angle = np.linspace(0.0, 2.0 * np.pi, _RIM)
    rim = prediction.radius_m * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    poses = prediction.proposals.world_from_contact
    return [rim @ pose[:3, :3].T + pose[:3, 3] for pose in poses]


def _table(prediction: Prediction) -> str:
    proposals = prediction.proposals
    rows = "\n".join(
        f"| {index + 1} | {proposals.quality[index]:.2f} | {pixel[0]}, {pixel[1]} "
        f"| {', '.join(f'{1e3 * value:.0f}' for value in pose[:3, 3])} |"
        for index, (pixel, pose) in enumerate(
            zip(prediction.pixel, prediction.camera_from_contact, strict=True)
        )
    )
    left_out = "\n".join(f"- {number}: {reason}" for reason, number in proposals.left_out.items())
    return (
        f"**{prediction.verdict}** (by {prediction.ranking})\n\n"
        f"| rank | q-hat | pixel | camera x, y, z in mm |\n|-|-|-|-|\n{rows}\n\n"
        f"Contacts left out:\n\n{left_out}\n"
    )
