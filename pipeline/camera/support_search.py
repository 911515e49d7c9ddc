"""The search for the support in what was measured.

The support is the largest plane that lies under nearly all that was measured and whose normal
points up. Where no pose says which way is up, the camera is taken to be held upright and to look
ahead or down: up is then towards the picture's upper edge and towards the camera.
"""

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage
from scipy.spatial import ConvexHull, QhullError

from pipeline.camera.floor_bend import fit_floor_bend
from pipeline.camera.planes import Plane, planes_of
from pipeline.camera.support import Support, from_edge
from pipeline.config.predict import SupportConfig
from pipeline.errors import PictureError
from pipeline.geometry.transforms import frame_from_z, invert, rotate_vectors, transform_points

# Up in CCS of a camera that is held upright and looks 45 degrees down.
UP_IN_CAMERA = np.array([0.0, -1.0, -1.0]) / np.sqrt(2.0)
_LEAST_DESCENT = 0.05  # an optical axis flatter than 3 degrees meets the table far away
_SPECK = 0.1  # of the largest piece: smaller ones are noise


def find_support(
    points_m: Float[np.ndarray, "n 3"],
    eyes_m: Float[np.ndarray, "n 3"],
    ahead: Float[np.ndarray, "n 3"],
    up: Float[np.ndarray, " 3"],
    up_known: bool,
    config: SupportConfig,
    rng: np.random.Generator,
) -> Support:
    """The support of what was measured.

    Parameters
    ----------
    points_m
        Measured points in the world.
    eyes_m
        Where the camera stood that measured each.
    ahead
        Which way that camera looked: its optical axis, unit vectors.
    up
        Which way is up in the world, a unit vector: gravity's opposite, or a guess.
    up_known
        Whether ``up`` is known; a guess may be farther off.
    config
        Tolerances and shares.
    rng
        Draws the points that planes are fitted to.

    Returns
    -------
    The plane with its outline and the walls around it.

    Raises
    ------
    PictureError
        No plane lies under what was measured.
    """
    off_rad = config.up_known_rad if up_known else config.up_guessed_rad
    found = list(planes_of(points_m, eyes_m, config.tolerance, config.smallest_share, rng))
    level = [
        plane
        for plane in found
        if plane.share >= config.support_share and plane.normal @ up >= np.cos(off_rad)
    ]
    distance_m = np.linalg.norm(points_m - eyes_m, axis=1)
    # A floor under clutter shows little of itself, but the tops of boxes on it are parallel to it.
    level += [
        shifted for plane in level for shifted in _parallel(plane, points_m, distance_m, config)
    ]
    below = [
        float(np.mean(plane.height_m(points_m) < -2 * config.tolerance * distance_m))
        for plane in level
    ]
    under_all = [i for i in range(len(level)) if below[i] <= config.below_max_share]
    if not under_all:
        raise PictureError(
            f"no table or bin floor was found: of {len(found)} planes "
            + (
                f"{len(level)} are level, and under the best of them lie "
                f"{100 * min(below):.0f} % of the points"
                if level
                else "none is level"
            ),
            "Give the camera's pose (world_from_camera, z up) or a mask, keep the picture to the "
            "table, or set predict.support.height_m",
        )
    plane = level[max(under_all, key=lambda i: level[i].share)]
    world_from_support = frame_from_z(plane.normal * plane.offset_m, plane.normal)
    to_support = invert(world_from_support)
    local = transform_points(to_support, points_m)
    near_m = config.tolerance * distance_m
    at = _looked_at(to_support, eyes_m, ahead)
    walls = _walls([p for p in found if p is not plane], to_support, local, near_m, at, config)
    bin_like = len(walls) >= 2
    # Between walls the floor may be hidden: what lies on it tells how far it goes.
    ground = local[:, 2] > -near_m if bin_like else np.abs(local[:, 2]) <= near_m
    for wall in walls:
        ground &= wall.height_m(local) > config.wall_margin_m
    piece = _piece_at(local[ground, :2], at, config.piece_gap_m)
    on_walls = np.zeros(len(local), dtype=bool)
    for wall in walls:
        on_walls |= (local[:, 2] > 2 * near_m) & (np.abs(wall.height_m(local)) <= near_m)
    outline_m = _outline(local[ground, :2][piece])
    within = (
        from_edge(outline_m, local[:, :2]) >= 0.0
        if len(outline_m) >= 3
        else np.zeros(len(local), dtype=bool)
    )
    return Support(
        world_from_support=world_from_support,
        share=plane.share,
        walls=tuple(walls),
        outline_m=outline_m,
        rim_m=float(np.percentile(local[on_walls, 2], 95)) if bin_like else np.inf,
        bend=fit_floor_bend(local[within], near_m[within], config),
    )


def _parallel(
    plane: Plane,
    points_m: Float[np.ndarray, "n 3"],
    distance_m: Float[np.ndarray, " n"],
    config: SupportConfig,
) -> list[Plane]:
    """Planes parallel to the given one and below it, at heights where many points lie."""
    height_m = plane.height_m(points_m)
    near_m = config.tolerance * float(np.median(distance_m))
    lowest = float(np.percentile(height_m, 100 * config.below_max_share / 2))
    found = []
    for offset_m in np.arange(lowest, -near_m, near_m):
        share = float(np.mean(np.abs(height_m - offset_m) <= near_m))
        if share >= config.support_share:
            found.append(Plane(plane.normal, plane.offset_m + float(offset_m), share))
    return found


def _looked_at(
    to_support: Float[np.ndarray, "4 4"],
    eyes_m: Float[np.ndarray, "n 3"],
    ahead: Float[np.ndarray, "n 3"],
) -> Float[np.ndarray, " 2"]:
    """The place on the support that the cameras look at, in its x and y; their mean."""
    eye = transform_points(to_support, eyes_m)
    direction = rotate_vectors(to_support, ahead)
    down = direction[:, 2] < -_LEAST_DESCENT
    if not down.any():  # cameras that look along the plane: what is below them
        return np.asarray(eye[:, :2].mean(axis=0))
    reach = -eye[down, 2] / direction[down, 2]
    return np.asarray((eye[down, :2] + reach[:, None] * direction[down, :2]).mean(axis=0))


def _walls(
    others: list[Plane],
    to_support: Float[np.ndarray, "4 4"],
    local_m: Float[np.ndarray, "n 3"],
    near_m: Float[np.ndarray, " n"],
    at: Float[np.ndarray, " 2"],
    config: SupportConfig,
) -> list[Plane]:
    """Upright planes that end the place the camera looks at.

    A wall is long: it runs along most of what was measured, and most of that lies on its inner
    side, with the place looked at. The face of a box is upright too, but short.
    """
    ground = local_m[:, 2] > -near_m
    walls: list[Plane] = []
    outsides: list[Plane] = []
    for plane in others:
        normal = rotate_vectors(to_support, plane.normal)
        if abs(normal[2]) > np.sin(config.wall_lean_rad):
            continue
        # A point x of the support's frame is R x + t in the world.
        offset_m = plane.offset_m - float(plane.normal @ invert(to_support)[:3, 3])
        seen_inside = bool(normal[:2] @ at > offset_m)
        side = 1.0 if seen_inside else -1.0
        wall = Plane(side * normal, side * offset_m, plane.share)
        height_m = wall.height_m(local_m)
        along = local_m[:, :2] @ np.array([-normal[1], normal[0]])
        # Any upright plane cuts the table along a line: what counts is what stands on it.
        on_wall = (local_m[:, 2] > 2 * near_m) & (np.abs(height_m) <= near_m)
        spans = _extent(along[on_wall]) >= config.wall_span_share * _extent(along[ground])
        inner = float(np.mean(height_m[ground] > -config.wall_margin_m))
        if spans and inner >= config.wall_inner_share:
            (walls if seen_inside else outsides).append(wall)
    # In a bin the wall next to the camera shows its outside; alone, that is the face of a box.
    return walls + outsides if walls else []


def _extent(along_m: Float[np.ndarray, " n"]) -> float:
    """Length of a line over which points lie, without the outermost 5 % at each end [m]."""
    return float(np.ptp(np.percentile(along_m, [5, 95]))) if len(along_m) else 0.0


def _piece_at(
    points_m: Float[np.ndarray, "n 2"], at: Float[np.ndarray, " 2"], gap_m: float
) -> Bool[np.ndarray, " n"]:
    """Points of the connected piece that is nearest to a place, seen from above.

    Two bins side by side have one floor plane, with a gap where their walls stand. Specks are no
    pieces.
    """
    if len(points_m) == 0:
        return np.zeros(0, dtype=bool)
    corner = points_m.min(axis=0)
    cell = np.floor((points_m - corner) / gap_m).astype(np.int64)
    filled = np.zeros(cell.max(axis=0) + 1, dtype=bool)
    filled[cell[:, 0], cell[:, 1]] = True
    pieces, _ = ndimage.label(filled, structure=np.ones((3, 3)))
    piece = pieces[cell[:, 0], cell[:, 1]]
    sizes = np.bincount(piece)
    large = np.flatnonzero(sizes >= _SPECK * sizes.max())
    distance = [float(np.linalg.norm(points_m[piece == p] - at, axis=1).min()) for p in large]
    return np.asarray(piece == large[np.argmin(distance)])


def _outline(points_m: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "corners 2"]:
    """Convex hull of a plane's visible part; its corners in order."""
    if len(points_m) < 3:
        return np.empty((0, 2))
    lower, upper = np.percentile(points_m, [0.5, 99.5], axis=0)
    kept = points_m[((points_m >= lower) & (points_m <= upper)).all(axis=1)]
    try:
        return np.asarray(kept[ConvexHull(kept).vertices])
    except (QhullError, ValueError):  # all on one line
        return np.empty((0, 2))
