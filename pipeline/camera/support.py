"""What objects stand on, and the walls around them: table, or bin floor and bin walls.

The support is the largest plane that lies under nearly all that was measured and whose normal
points up. Where no pose says which way is up, up is taken as in any picture of a camera that is
held upright and looks ahead or down: towards the picture's upper edge and towards the camera.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage
from scipy.spatial import ConvexHull, QhullError

from pipeline.camera.floor_bend import FloorBend, fit_floor_bend
from pipeline.camera.planes import Plane, planes_of
from pipeline.config.predict import PredictConfig, SupportConfig
from pipeline.errors import PictureError
from pipeline.geometry.transforms import frame_from_z, invert, rotate_vectors, transform_points

# Up in CCS of a camera that is held upright and looks 45 degrees down.
UP_IN_CAMERA = np.array([0.0, -1.0, -1.0]) / np.sqrt(2.0)
_LEAST_DESCENT = 0.05  # an optical axis flatter than 3 degrees meets the table far away
_SPECK = 0.1  # of the largest piece: smaller ones are noise


@dataclass(frozen=True, eq=False)
class Support:
    """The plane that objects stand on, with what bounds the place above it.

    Attributes
    ----------
    world_from_support
        Frame on the plane, z up, shape (4, 4).
    share
        Share of the measured points that lie on the plane.
    walls
        Upright planes around, in the support's frame, normals inwards.
    outline_m
        Corners of the plane's visible part, in its own x and y, shape (n, 2).
    rim_m
        Height of the walls' upper edge over the plane; infinite where there are not two walls
        [m].
    bend
        How the floor departs from the plane; None where too little of it is seen to tell.
    """

    world_from_support: Float[np.ndarray, "4 4"]
    share: float
    walls: tuple[Plane, ...]
    outline_m: Float[np.ndarray, "corners 2"]
    rim_m: float = np.inf
    bend: FloorBend | None = None

    def height_m(self, points_m: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        """Height of points of the support's frame over the floor, bent as it is [m]."""
        height = points_m[:, 2]
        return height if self.bend is None else height - self.bend.height_m(points_m[:, :2])


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
        _from_edge(outline_m, local[:, :2]) >= 0.0
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


def level_support(height_m: float) -> Support:
    """A support at a known height of a world whose z is up, without an edge."""
    pose = np.eye(4)
    pose[2, 3] = height_m
    return Support(pose, 0.0, (), np.empty((0, 2)))


def stands_out(
    support: Support,
    points_m: Float[np.ndarray, "n 3"],
    eyes_m: Float[np.ndarray, "n 3"],
    config: PredictConfig,
) -> Bool[np.ndarray, " n"]:
    """Whether points belong to what stands on the support: off floor, walls and their rounding.

    Parameters
    ----------
    support
        What was found.
    points_m
        In the support's frame.
    eyes_m
        Where the camera stood that measured each, in the same frame.
    config
        How far out of the support things stand, and the margins of walls.

    Returns
    -------
    Whether each point does, shape (n,).
    """
    distance_m = np.linalg.norm(points_m - eyes_m, axis=1)
    least_m = np.maximum(config.above_support_m, config.above_support_share * distance_m)
    height_m = support.height_m(points_m)
    chosen = np.asarray(height_m > least_m)
    chosen[chosen] = inside(support, points_m[chosen], config.support)
    low = chosen & (height_m < config.support.rounding_m)
    chosen[low] = ~_on_rounding(support, points_m[low], height_m[low], least_m[low], config.support)
    return chosen


def inside(
    support: Support, points_m: Float[np.ndarray, "n 3"], config: SupportConfig
) -> Bool[np.ndarray, " n"]:
    """Whether points lie above the support's visible part, within the walls.

    Parameters
    ----------
    support
        What was found.
    points_m
        In the support's frame.
    config
        Margins.

    Returns
    -------
    Whether each point does, shape (n,).
    """
    within = np.ones(len(points_m), dtype=bool)
    for wall in support.walls:
        within &= wall.height_m(points_m) > config.wall_margin_m
    if len(support.outline_m) >= 3:
        middle = support.outline_m.mean(axis=0)
        away = support.outline_m - middle
        length = np.linalg.norm(away, axis=1, keepdims=True)
        grown = middle + away * (length + config.outline_margin_m) / np.maximum(length, 1e-9)
        x, y = np.ascontiguousarray(points_m[:, :2].T)
        # Edge by edge: a matrix product waits for OpenBLAS's threads, ten times as long.
        for outward_x, outward_y, offset in ConvexHull(grown).equations:
            within &= outward_x * x + outward_y * y + offset <= 0.0
        # A wall whose inner side is hidden shows its rim alone.
        high = within & (points_m[:, 2] > support.rim_m - config.rim_m)
        within[high] = _from_edge(support.outline_m, points_m[high, :2]) >= config.rim_m
    return within


def _from_edge(
    corners_m: Float[np.ndarray, "corners 2"], points_m: Float[np.ndarray, "n 2"]
) -> Float[np.ndarray, " n"]:
    """Distance from the nearest edge of a convex outline; negative outside [m]."""
    middle = corners_m.mean(axis=0)
    nearest = np.full(len(points_m), np.inf)
    for corner, following in zip(corners_m, np.roll(corners_m, -1, axis=0), strict=True):
        along = following - corner
        length = float(np.linalg.norm(along))
        if length == 0.0:
            continue
        normal = np.array([-along[1], along[0]]) / length
        if normal @ (middle - corner) < 0:
            normal = -normal
        nearest = np.minimum(nearest, (points_m - corner) @ normal)
    return nearest


def _on_rounding(
    support: Support,
    points_m: Float[np.ndarray, "n 3"],
    height_m: Float[np.ndarray, " n"],
    least_m: Float[np.ndarray, " n"],
    config: SupportConfig,
) -> Bool[np.ndarray, " n"]:
    """Whether points may belong to the rounding with which a bin's floor passes into its walls.

    A ball of the rounding's radius that rolls in the bin stays a radius away from floor and walls.
    What it cannot touch lies more than a radius from all places that its centre can be in.

    Parameters
    ----------
    support
        What was found; without two walls it is no bin, and has no rounding.
    points_m
        In the support's frame.
    height_m
        Height of each over the floor [m].
    least_m
        How far out of a surface each must stand to be told from it [m].
    config
        The rounding's radius, and margins.

    Returns
    -------
    Whether each point may, shape (n,).
    """
    if len(support.walls) < 2 or len(support.outline_m) < 3:
        return np.zeros(len(points_m), dtype=bool)
    radius_m = config.rounding_m
    # How far the ball's centre must keep inwards of each point, for each wall.
    lacking = [radius_m - wall.height_m(points_m) for wall in support.walls]
    across = np.maximum(np.max(lacking, axis=0), 0.0)
    for i, one in enumerate(support.walls):
        for j in range(i):
            turn = float(one.normal @ support.walls[j].normal)
            across = np.maximum(across, _to_corner(lacking[i], lacking[j], turn))
    # A wall that is hidden or not flat ends the outline, a margin inwards of itself.
    edge_m = _from_edge(support.outline_m, points_m[:, :2]) + config.wall_margin_m
    across = np.maximum(across, radius_m - edge_m)
    up = np.maximum(radius_m - height_m, 0.0)
    return np.asarray(np.hypot(across, up) > radius_m - least_m)


def _to_corner(
    first_m: Float[np.ndarray, " n"], second_m: Float[np.ndarray, " n"], turn: float
) -> Float[np.ndarray, " n"]:
    """Distance to the wedge between two planes, where both are lacking [m].

    Parameters
    ----------
    first_m
        How far each point is outside the first plane, negative inside [m].
    second_m
        The same of the second [m].
    turn
        Cosine between their normals.

    Returns
    -------
    Distance where the nearest place of the wedge lies on its edge, else 0; shape (n,).
    """
    at_edge = (second_m > turn * first_m) & (first_m > turn * second_m)
    square = first_m**2 + second_m**2 - 2.0 * turn * first_m * second_m
    sine2 = max(1.0 - turn**2, 1e-9)
    return np.where(at_edge, np.sqrt(np.maximum(square, 0.0) / sine2), 0.0)


def _parallel(
    plane: Plane,
    points_m: Float[np.ndarray, "n 3"],
    distance_m: Float[np.ndarray, " n"],
    config: SupportConfig,
) -> list[Plane]:
    """Planes parallel to one, at lower heights at which many points lie."""
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
    """Where on the support the cameras look, in its own x and y: the mean over their pictures."""
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
    """Length over which points lie along a line, without the outermost twentieth a side [m]."""
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
