"""Where to try: contacts on the measured cloud, approach along the mean surface normal.

Supplement VI: sub point clouds are sampled at random, and the grasp direction of each is its
average surface normal.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from pipeline.config.evaluation import PolicyConfig
from pipeline.gripper.sampling import contact_frames

TABLE_CLEARANCE_M = 0.006  # measured points lower than this may be the table
_FEWEST_POINTS = 6  # a plane through fewer is no surface


def above_table(points_m: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "m 3"]:
    """Finite points that cannot be the table's."""
    finite = np.isfinite(points_m).all(axis=1)
    kept = finite & (np.nan_to_num(points_m[:, 2]) > TABLE_CLEARANCE_M)
    return np.asarray(points_m[kept])


def sample_candidates(
    points_m: Float[np.ndarray, "n 3"],
    eye_m: Float[np.ndarray, " 3"],
    normal_radius_m: float,
    config: PolicyConfig,
    rng: np.random.Generator,
) -> Float[np.ndarray, "k 4 4"]:
    """u contacts at random on the cloud, as world_from_contact; fewer where surfaces are too steep.

    points_m : measured points in WCS without the table. eye_m : the camera, to tell outside.
    """
    at = rng.integers(len(points_m), size=config.candidates)
    return candidates_at(points_m, at, eye_m, normal_radius_m, config.tilt_max_rad)


def sample_near(
    points_m: Float[np.ndarray, "n 3"],
    contact_m: Float[np.ndarray, " 3"],
    eye_m: Float[np.ndarray, " 3"],
    normal_radius_m: float,
    config: PolicyConfig,
    rng: np.random.Generator,
) -> Float[np.ndarray, "k 4 4"]:
    """The same within ``correction_radius_m`` of a contact, for corrections on the way down."""
    near = np.flatnonzero(
        np.linalg.norm(points_m - contact_m, axis=1) <= config.correction_radius_m
    )
    if len(near) == 0:
        return np.empty((0, 4, 4))
    at = near[rng.integers(len(near), size=min(config.candidates, 4 * len(near)))]
    return candidates_at(points_m, at, eye_m, normal_radius_m, config.tilt_max_rad)


def candidates_at(
    points_m: Float[np.ndarray, "n 3"],
    at: Int[np.ndarray, " k"],
    eye_m: Float[np.ndarray, " 3"],
    radius_m: float,
    tilt_max_rad: float,
) -> Float[np.ndarray, "m 4 4"]:
    """world_from_contact of the chosen points whose mean normal is not too far off the vertical."""
    near = cKDTree(points_m).query_ball_point(points_m[at], radius_m)
    frames = []
    for index, neighbours in zip(at, near, strict=True):
        if len(neighbours) < _FEWEST_POINTS:
            continue
        patch = points_m[neighbours]
        centred = patch - patch.mean(axis=0)
        normal = np.linalg.eigh(centred.T @ centred)[1][:, 0]
        normal = normal if normal @ (eye_m - points_m[index]) > 0 else -normal
        if normal[2] >= np.cos(tilt_max_rad):
            # The patch's mean is nearer to the surface than one noisy point.
            on_plane = points_m[index] + normal * (normal @ (patch.mean(axis=0) - points_m[index]))
            frames.append((on_plane, normal))
    if not frames:
        return np.empty((0, 4, 4))
    contacts, normals = (np.array(part) for part in zip(*frames, strict=True))
    return contact_frames(contacts, normals, np.zeros(len(contacts)))
