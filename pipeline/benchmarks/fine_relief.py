"""How far labels follow relief that no camera sees: objects as they are, and smoothed over a cell.

`python -m pipeline.benchmarks.fine_relief runs/release val test` prints a line of JSON an object of
these splits; random solids are of split train. A network sees an object in cells of a tenth of the
pad's radius, through noise of a millimetre or more; where q changes when relief finer than a cell
is taken away, no picture can tell it, and the change is an error that no network avoids but by
knowing the object.
"""

import json
import math
import sys
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Float
from scipy.spatial import cKDTree

from pipeline.config import RunConfig, load_run_config
from pipeline.geometry.mesh import Mesh
from pipeline.labelling.mesh import label_mesh
from pipeline.labelling.sampling import contact_frames, mean_normals
from pipeline.messages.objects import read_objects

GRASPS = 400  # an object: a second, and its mean q within 0.02
SURFACE_POINTS = 20_000  # over which normals are averaged
AROUND_M = 0.006  # of a contact, within which the surface is compared with a quadric
APART_M = 0.0007  # mean distance of the points that are compared
PLACES = 120  # of a surface, where it is
LEAST_POINTS = 30  # of six numbers that they decide
HALFWAY = 0.5  # a step of smoothing moves each vertex so far towards its neighbours' mean


def without_fine_relief(mesh: Mesh, length_m: float) -> Mesh:
    """The surface smoothed over a length: finer relief is gone, the volume is kept.

    Parameters
    ----------
    mesh
        A closed surface [m].
    length_m
        Standard deviation of the smoothing along the surface [m].

    Returns
    -------
    The same triangles over other vertices.
    """
    smoothed = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
    # Each step spreads a vertex over its neighbours: variances add up.
    variance = HALFWAY * float(np.mean(smoothed.edges_unique_length**2))
    steps = max(math.ceil(length_m**2 / variance), 1)
    trimesh.smoothing.filter_laplacian(smoothed, lamb=HALFWAY, iterations=steps)
    return Mesh(np.array(smoothed.vertices), mesh.faces)


def strays_from_quadrics_m(mesh: Mesh, rng: np.random.Generator) -> float:
    """How far a surface strays from the quadrics that fit it best, each within 6 mm of a point.

    Parameters
    ----------
    mesh
        The surface [m].
    rng
        Draws the points.

    Returns
    -------
    The median over the points of the root mean square of distances [m].
    """
    solid = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
    points, faces = trimesh.sample.sample_surface(solid, int(solid.area / APART_M**2), seed=rng)
    points, normals = np.array(points), np.array(solid.face_normals[faces])
    tree, strays_m = cKDTree(points), []
    for place in rng.choice(len(points), PLACES):
        near = np.array(tree.query_ball_point(points[place], AROUND_M))
        near = near[normals[near] @ normals[place] > 0]  # not the other side of a wall
        if len(near) < LEAST_POINTS:
            continue
        upwards = normals[near].mean(axis=0)
        upwards /= np.linalg.norm(upwards)
        axes = contact_frames(points[[place]], upwards[None], np.zeros(1))[0, :3, :3]
        x, y, z = ((points[near] - points[place]) @ axes).T
        terms = np.column_stack([np.ones(len(x)), x, y, x * x, x * y, y * y])
        off_m = z - terms @ np.linalg.lstsq(terms, z, rcond=None)[0]
        strays_m.append(float(np.sqrt(np.mean(off_m**2))))
    return float(np.median(strays_m))


def poses_on(mesh: Mesh, radius_m: float, rng: np.random.Generator) -> Float[np.ndarray, "n 4 4"]:
    """Contacts spread over a surface, each approached along the mean normal around it.

    Parameters
    ----------
    mesh
        The surface [m].
    radius_m
        Normals within this distance are averaged [m].
    rng
        Draws places and spins.

    Returns
    -------
    object_from_gripper of each contact, shape (n, 4, 4).
    """
    solid = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
    points, faces = trimesh.sample.sample_surface(solid, SURFACE_POINTS, seed=rng)
    contacts = np.array(points[:GRASPS])
    approach = mean_normals(
        np.array(points), np.array(solid.face_normals[faces]), contacts, radius_m
    )
    return contact_frames(contacts, approach, rng.uniform(0.0, 2 * np.pi, len(contacts)))


def relief_in_labels(mesh: Mesh, config: RunConfig, rng: np.random.Generator) -> dict[str, float]:
    """What the relief finer than a cell does to the labels of one object, alone in the world.

    Parameters
    ----------
    mesh
        Its surface [m].
    config
        Gripper, grasps and the cells' side.
    rng
        Draws the grasps.

    Returns
    -------
    ``relief_mm``, what smoothing took off, as a root of mean squares; ``mean_q`` of the object as
    it is, ``mean_q_smoothed``, and ``change``, the mean of |q - q smoothed|; ``strays_mm``, see
    `strays_from_quadrics_m`.
    """
    cell_m = config.sensing.grid_side_m / config.sensing.grid_cells
    smoothed = without_fine_relief(mesh, cell_m)
    poses = poses_on(mesh, config.grasps.normal_radius_m, rng)
    rough, smooth = (label_mesh(surface, poses, config).q for surface in (mesh, smoothed))
    taken_off_m = np.linalg.norm(smoothed.vertices_m - mesh.vertices_m, axis=1)
    return {
        "relief_mm": round(1e3 * float(np.sqrt(np.mean(taken_off_m**2))), 2),
        "mean_q": round(float(rough.mean()), 3),
        "mean_q_smoothed": round(float(smooth.mean()), 3),
        "change": round(float(np.abs(rough - smooth).mean()), 3),
        "strays_mm": round(1e3 * strays_from_quadrics_m(mesh, rng), 3),
    }


if __name__ == "__main__":
    run, splits = Path(sys.argv[1]), sys.argv[2:]
    settings = load_run_config(run / "run.toml")
    for name, (item, split) in read_objects(run / "objects.mcap").items():
        if split in splits:
            figures = relief_in_labels(item.mesh, settings, np.random.default_rng(settings.seed))
            sys.stdout.write(json.dumps({"object": name} | figures) + "\n")
