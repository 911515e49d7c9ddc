"""What finer meshes cost: the same surfaces, each triangle cut in four again and again.

`python -m pipeline.benchmarks.mesh_size runs/bench level1-test-00` labels one clutter of a run so,
against an older commit; without a clutter it finds heights by both ways on bumpy balls.
"""

import json
import sys
import time
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np
import trimesh

from pipeline.benchmarks.commits import compare, plain_scene, read_clutter
from pipeline.benchmarks.labelling import bumpy
from pipeline.config import RunConfig
from pipeline.geometry.mesh import Mesh
from pipeline.gripper import pad_of
from pipeline.labelling.heights import pad_heights_by_rays
from pipeline.labelling.sampling import contact_frames
from pipeline.world.lines_down import PosedBlocks, follow_lines
from pipeline.world.raycasting import RayScene
from pipeline.world.scene import ClutterScene
from pipeline.world.triangle_blocks import blocks_of

CUTS = (0, 1, 2)  # a triangle becomes 1, 4, 16: scans of 16 k faces reach 262 k
BALLS = (3, 4, 5, 6, 7)  # 1 280 to 327 680 faces
GRASPS = 256  # a ball: a turn of both ways takes less than a second
TURNS = 4  # the least of them is told


def cut_in_four(mesh: Mesh, times: int) -> Mesh:
    """The same surface with four triangles for each, and so on."""
    vertices, faces = np.asarray(mesh.vertices_m), np.asarray(mesh.faces)
    for _ in range(times):
        vertices, faces = trimesh.remesh.subdivide(vertices, faces)
    return Mesh(vertices, faces)


def labelling_by_faces(scene: ClutterScene, meshes: Mapping[str, Mesh]) -> dict[int, float]:
    """Median faces of a clutter's objects → times as fast as the older commit labels it.

    Parameters
    ----------
    scene
        The clutter: where its objects lie and its pictures stay the same.
    meshes
        Surface of each object by its name [m].

    Returns
    -------
    One ratio of processor time for each fineness; empty without the older commit.
    """
    ratios = {}
    for times in CUTS:
        used = {item.object_name for item in scene.objects}
        finer = {name: cut_in_four(meshes[name], times) for name in used}
        faces = int(np.median([len(finer[item.object_name].faces) for item in scene.objects]))
        for ratio in compare(plain_scene(scene, finer), ("label",)).values():
            ratios[faces] = round(ratio, 2)
    return ratios


def heights_by_faces() -> dict[int, dict[str, float]]:
    """Faces → processor time of a grasp's heights [us], drawn and by rays, on bumpy balls."""
    pad, config = pad_of(RunConfig().gripper.pad), RunConfig()
    found = {}
    for subdivisions in BALLS:
        ball = trimesh.creation.icosphere(subdivisions=subdivisions)
        mesh, rng = bumpy(ball), np.random.default_rng(0)
        chosen = rng.integers(len(mesh.vertices_m), size=GRASPS)
        frames = contact_frames(
            mesh.vertices_m[chosen], ball.vertices[chosen], rng.uniform(0, 2 * np.pi, GRASPS)
        )
        scene, posed = RayScene([mesh]), [PosedBlocks(blocks_of(mesh), np.eye(4), 0)]
        points, top = pad.vertices_xy_m, config.grasps.clearance_m
        ways: dict[str, Callable[[], object]] = {
            "drawn": partial(follow_lines, posed, frames, points, top),
            "rays": partial(pad_heights_by_rays, frames, scene, pad, top),
        }
        found[len(mesh.faces)] = _least_us(ways)
    return found


def _least_us(ways: Mapping[str, Callable[[], object]]) -> dict[str, float]:
    """Least processor time a grasp of each way [us], in turn, after one call to compile."""
    times: dict[str, list[float]] = {name: [] for name in ways}
    for _ in range(1 + TURNS):
        for name, way in ways.items():
            started = time.process_time()
            way()
            times[name].append(time.process_time() - started)
    return {name: round(1e6 * min(each[1:]) / GRASPS, 1) for name, each in times.items()}


if __name__ == "__main__":
    if len(sys.argv) == 1:
        answer: object = heights_by_faces()
    else:
        answer = labelling_by_faces(*read_clutter(Path(sys.argv[1]), sys.argv[2]))
    sys.stdout.write(json.dumps(answer) + "\n")
