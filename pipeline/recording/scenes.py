"""scenes.rrd: each clutter in 3-D with its cameras, pictures, cloud and table of facts."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pipeline.clutter.levels import level_of
from pipeline.geometry.mesh import Mesh
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scene, scene_count
from pipeline.recording import colours
from pipeline.recording.recording import (
    FinishedStage,
    eye_at,
    recording,
    set_step,
    start_path,
    time_panel,
)
from pipeline.recording.shapes import shown_mesh, shown_pose
from pipeline.spread import choose_evenly
from pipeline.world.cameras import points_of_depth
from pipeline.world.scene import ClutterScene
from pipeline.world.scene_cameras import camera_names
from pipeline.world.view import CameraView

TIMELINE = "scene"
FRUSTUM_M = 0.15  # a camera is drawn this long
CLOUD_EVERY = 3  # every third pixel a side: a ninth of the points


SHOWN_CAMERAS = 3  # more rows are too small to see; their pictures are in the recording
PICTURES = ("colour", "depth", "segmentation", "normals")


def draw_scenes(stage: FinishedStage, figures: Mapping[str, Any]) -> None:
    """Draw the recording: some of the finished scenes, read back."""
    items = read_objects(stage.upstream("objects"))
    meshes = {name: item.mesh for name, (item, _) in items.items()}
    nsvr = {name: item.nsvr for name, (item, _) in items.items()}
    shown = choose_evenly(scene_count(stage.output), stage.config.recording.scenes)
    with recording(stage, blueprint(camera_names(stage.config.cameras))) as stream:
        for number, index in enumerate(shown):
            show_scene(stream, number, read_scene(stage.output, index), meshes, nsvr)


def blueprint(cameras: Sequence[str]) -> rrb.Blueprint:
    """Opens on the scene in 3-D; beside it the pictures, a row a camera, and the facts."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(
                origin="/world",
                contents=[
                    "$origin/**",
                    *(f"- $origin/{name}/{kind}" for name in cameras for kind in PICTURES[1:]),
                ],
                name="Scene, cameras and coloured cloud",
                eye_controls=eye_at((-0.75, -0.75, 0.7), (0.05, 0.05, 0.05)),
            ),
            rrb.Vertical(
                rrb.Grid(
                    *(
                        _picture(name, kind)
                        for name in cameras[:SHOWN_CAMERAS]
                        for kind in PICTURES
                    ),
                    grid_columns=len(PICTURES),
                ),
                rrb.TextDocumentView(origin="/notes/scene", name="Level, gaps, NSVR"),
                row_shares=[3, 2],
            ),
            column_shares=[1, 1],
        ),
        time_panel(TIMELINE),
        collapse_panels=True,
    )


def _picture(camera: str, kind: str) -> rrb.Spatial2DView:
    """One picture that a camera took, exact."""
    path = f"/world/{camera}/{kind}"
    return rrb.Spatial2DView(origin=path, contents=path, name=f"{camera} {kind}")


def show_scene(
    stream: rr.RecordingStream,
    number: int,
    scene: ClutterScene,
    meshes: Mapping[str, Mesh],
    nsvr: Mapping[str, float],
) -> None:
    """One step of the recording."""
    set_step(stream, TIMELINE, number)
    objects = start_path(stream, "world/objects", number)
    for placed in scene.objects:
        path = f"{objects}/{placed.body_id:02d}"
        mesh = meshes[placed.object_name]
        stream.log(path, shown_mesh(mesh, colours.by_index(placed.body_id)))
        stream.log(path, shown_pose(placed.world_from_object))
    for view in scene.views:
        _show_view(stream, f"world/{view.camera.name}", view)
    stream.log(
        "notes/scene", rr.TextDocument(_facts(scene, nsvr), media_type=rr.MediaType.MARKDOWN)
    )


def _show_view(stream: rr.RecordingStream, path: str, view: CameraView) -> None:
    camera = view.camera
    stream.log(path, shown_pose(camera.world_from_camera))
    stream.log(
        path,
        rr.Pinhole(
            image_from_camera=camera.intrinsics,
            resolution=[camera.width_px, camera.height_px],
            camera_xyz=rr.ViewCoordinates.RDF,
            image_plane_distance=FRUSTUM_M,
        ),
    )
    stream.log(f"{path}/colour", rr.Image(view.colour).compress(jpeg_quality=90))
    stream.log(f"{path}/depth", rr.DepthImage(view.depth_m.astype(np.float16), meter=1.0))
    stream.log(f"{path}/segmentation", rr.SegmentationImage(view.segmentation))
    stream.log(f"{path}/normals", rr.Image(view.normals).compress(jpeg_quality=90))
    points, rows, columns = points_of_depth(view.depth_m, camera, CLOUD_EVERY)
    stream.log(
        f"world/cloud/{camera.name}",
        rr.Points3D(points, colors=view.colour[rows, columns], radii=0.0012),
    )


def _facts(scene: ClutterScene, nsvr: Mapping[str, float]) -> str:
    shape_class, distribution = level_of(scene.level)
    rows = "\n".join(
        f"| {placed.body_id} | {placed.object_name} | {nsvr[placed.object_name]:.2f} "
        f"| {1e3 * gap:.1f} |"
        for placed, gap in zip(scene.objects, scene.gaps_m, strict=True)
    )
    return (
        f"**Level {scene.level}: {shape_class}, {distribution}** ({scene.split})\n\n"
        f"{scene.scene_id}, {len(scene.contacts)} contacts, "
        f"settled in {scene.settle_time_s:.2f} s\n\n"
        f"| id | object | NSVR | nearest gap in mm |\n|-|-|-|-|\n{rows}\n"
    )
