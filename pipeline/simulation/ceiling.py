"""The ceiling: what the best of many poses bears of an object, as it lies, on its true surface.

No policy can lift what no pose holds. Poses are drawn over the object's surface, from all sides
that the robot reaches without its stem meeting a body, and no steeper than the policy may try. The
label says cheaply which of them may bear most; the judge says what the best of these, and where
none of them lifts the object poses near the best, do bear through a whole attempt.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float, Int

from pipeline.config import RunConfig
from pipeline.config.grasps import GraspsConfig
from pipeline.control.clearance import free_of_collision
from pipeline.control.viewpoints import back_off
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.transforms import invert, rotate_vectors, transform_points
from pipeline.gripper.pad import Pad
from pipeline.labelling.heights import pad_heights
from pipeline.labelling.sampling import (
    Candidates,
    VisibleSurface,
    join_candidates,
    propose,
    propose_nearby,
)
from pipeline.simulation.judges import Judge
from pipeline.simulation.payload import GRAVITY_M_S2, weight_borne_n
from pipeline.simulation.suction import seal_limits
from pipeline.world.posed_bodies import PosedScene

Pose = Float[np.ndarray, "4 4"]

_POINTS = 4000  # of a surface: 3 mm apart on 100 mm, under the margin that the stem keeps
_DRAWS = 4  # rounds of drawing after which fewer reachable poses than wanted must do
_ABOVE_M = 1e3  # from so high, all that faces up is seen
_PLACES = 3  # of the best so far, near each of which further poses are tried
_APART_RG = 0.2  # poses nearer than this bear much the same: one of them is judged [r_G]
_STILL_M, _STILL_RAD = 5e-4, 5e-3  # less is no move: it changes no seal that matters


@dataclass(frozen=True, eq=False)
class Best:
    """The best pose found on one object.

    Attributes
    ----------
    borne_n
        Largest weight that its seal bears through an attempt [N]; 0 where no pose holds anything.
    weight_n
        Weight of the object [N].
    world_from_gripper
        The pose, shape (4, 4); the identity where none holds anything.
    reached
        How many poses that the robot reaches it was found among.
    """

    borne_n: float
    weight_n: float
    world_from_gripper: Pose
    reached: int

    @property
    def lifts(self) -> bool:
        """Whether the object can be lifted at all."""
        return self.borne_n >= self.weight_n


class Ceilings:
    """The best pose of each object of a clutter; looked for anew only where something moved."""

    def __init__(
        self,
        items: Mapping[int, CatalogueObject],
        pad: Pad,
        judge: Judge,
        reachable: Callable[[Pose], bool],
        config: RunConfig,
        seed: int,
    ) -> None:
        """Store the arguments.

        Parameters
        ----------
        items
            Catalogue entry of each body.
        pad
            The pad in GCS, for the sifting.
        judge
            Says what a pose bears.
        reachable
            Whether the robot can take a pose.
        config
            Sections gripper, grasps and evaluate.
        seed
            Of the poses that are drawn, whatever the policy.
        """
        self._items = items
        self._pad = pad
        self._judge = judge
        self._reachable = reachable
        self._config = config
        self._seed = seed
        self._found: dict[int, tuple[dict[int, Pose], Best]] = {}

    def update(self, poses: Mapping[int, Pose], surfaces: PosedScene) -> dict[int, Best]:
        """The best pose of each object as it lies now.

        What was found before stays where neither the object nor a body near it moved; and where
        bodies near it are gone and it could be lifted already, so that it bears at least that much.
        With ``ceiling.first_that_lifts``, a pose that lifted the object before is tried first,
        moved with it.

        Parameters
        ----------
        poses
            Pose of each body that is still there, by its id.
        surfaces
            Their true surfaces.

        Returns
        -------
        Body id → its best pose.
        """
        for body in sorted(poses):
            near, before = self._near(body, poses), self._found.get(body)
            if before is None or self._may_differ(body, before, near):
                again = self._try_again(body, before, poses, surfaces) if before else None
                self._found[body] = near, again or self._look(body, poses, surfaces)
        return {body: self._found[body][1] for body in poses}

    def _near(self, body: int, poses: Mapping[int, Pose]) -> dict[int, Pose]:
        """The body's own pose, and those of the bodies that pad or stem may meet with it."""
        reach_m = 2 * self._config.gripper.pad.radius_m + _radius_m(self._items[body].mesh)
        own_m = poses[body][:3, 3]
        return {
            other: pose
            for other, pose in poses.items()
            if np.linalg.norm(pose[:3, 3] - own_m) <= reach_m + _radius_m(self._items[other].mesh)
        }

    def _may_differ(
        self, body: int, before: tuple[dict[int, Pose], Best], near: Mapping[int, Pose]
    ) -> bool:
        then, best = before
        if any(other not in then or _moved(then[other], pose) for other, pose in near.items()):
            return True
        return len(near) < len(then) and not best.lifts

    def _try_again(
        self,
        body: int,
        before: tuple[dict[int, Pose], Best],
        poses: Mapping[int, Pose],
        surfaces: PosedScene,
    ) -> Best | None:
        """The pose that lifted the object before, moved with it; None where it does no longer."""
        then, best = before
        if not (self._config.evaluate.ceiling.first_that_lifts and best.lifts):
            return None
        frame = poses[body] @ invert(then[body]) @ best.world_from_gripper
        one = Candidates(frame[None], np.array([body]), np.zeros(1), np.zeros(1, dtype=np.int64))
        one = self._reached(one, surfaces, self._obstacles_m(poses))
        borne_n = self._borne_n(one, poses[body], surfaces, best.weight_n)
        if not (borne_n >= best.weight_n).any():
            return None
        return Best(float(borne_n[0]), best.weight_n, one.world_from_contact[0], best.reached)

    def _obstacles_m(self, poses: Mapping[int, Pose]) -> Float[np.ndarray, "n 3"]:
        """Points of all bodies' surfaces, that hand and stem keep clear of, in WCS [m]."""
        return np.concatenate(
            [transform_points(poses[i], _points_of(self._items[i].mesh)[0]) for i in sorted(poses)]
        )

    def _look(self, body: int, poses: Mapping[int, Pose], surfaces: PosedScene) -> Best:
        """Draw, sift, judge; where none of these lifts the object, judge again near the best."""
        weight_n = GRAVITY_M_S2 * self._items[body].mass_kg
        wanted, rng = self._config.evaluate.ceiling, np.random.default_rng([self._seed, body])
        surface = upward_surface(self._items[body].mesh, poses[body], body)
        obstacles_m = self._obstacles_m(poses)
        drawn: list[Candidates] = []
        while len(surface.points_m) and len(drawn) < _DRAWS and _count(drawn) < wanted.poses:
            some = propose(surface, wanted.poses, _from_all_sides(self._config.grasps), rng)
            drawn.append(self._reached(some, surfaces, obstacles_m))
        if _count(drawn) == 0:
            return Best(0.0, weight_n, np.eye(4), 0)
        tried = join_candidates(drawn)
        tried = tried.take(np.arange(min(len(tried), wanted.poses)))
        expected = self._expected_n(tried, poses[body], surfaces)
        apart_m = _APART_RG * self._config.gripper.pad.radius_m
        judged = tried.take(likeliest_apart(tried, expected, wanted.judged, apart_m))
        enough_n = weight_n if wanted.first_that_lifts else np.inf
        borne_n = self._borne_n(judged, poses[body], surfaces, enough_n)
        for _ in range(wanted.steps):
            if not 0.0 < borne_n.max(initial=0.0) < weight_n:
                break
            best = np.argsort(-borne_n, kind="stable")[:_PLACES]
            origins = judged.take(np.repeat(best, -(-wanted.nearby // len(best))))
            near = propose_nearby(surface, origins, _from_all_sides(self._config.grasps), rng)
            near = self._reached(near, surfaces, obstacles_m)
            judged = join_candidates([judged, near])
            more_n = self._borne_n(near, poses[body], surfaces, enough_n)
            borne_n = np.concatenate([borne_n, more_n])
        if not borne_n.any():
            return Best(0.0, weight_n, np.eye(4), len(tried))
        first = int(np.argmax(borne_n))
        pose = judged.world_from_contact[first]
        return Best(float(borne_n[first]), weight_n, pose, len(tried))

    def _reached(
        self, some: Candidates, surfaces: PosedScene, obstacles_m: Float[np.ndarray, "n 3"]
    ) -> Candidates:
        """Those that the robot reaches, each moved to where the pad first touches anything."""
        evaluate, clearance_m = self._config.evaluate, self._config.grasps.clearance_m
        heights, _ = pad_heights(some.world_from_contact, surfaces, self._pad, clearance_m)
        top_m = heights.max(axis=1)
        touching = some.world_from_contact.copy()
        touching[:, :3, 3] += np.where(np.isfinite(top_m), top_m, 0.0)[:, None] * touching[:, :3, 2]
        free = np.isfinite(top_m) & free_of_collision(touching, obstacles_m, evaluate.hand)
        free &= touching[:, 2, 2] >= np.cos(evaluate.policy.steepest_rad)
        standoff_m = evaluate.policy.standoff_m
        able = [
            row
            for row in np.flatnonzero(free)
            if self._reachable(touching[row])
            and self._reachable(back_off(touching[row], standoff_m))
        ]
        chosen = np.array(able, dtype=np.int64)
        kept = some.take(chosen)
        return Candidates(touching[chosen], kept.body_id, kept.tilt_rad, kept.proposal)

    def _expected_n(
        self, tried: Candidates, pose: Pose, surfaces: PosedScene
    ) -> Float[np.ndarray, " n"]:
        """What each would bear by the label's limits [N]: cheap, and good for the order."""
        gripper, evaluate = self._config.gripper, self._config.evaluate
        frames, clearance_m = tried.world_from_contact, self._config.grasps.clearance_m
        heights, below = pad_heights(frames, surfaces, self._pad, clearance_m)
        on_target = below == tried.body_id[:, None]
        limits = (
            seal_limits(self._pad, heights[row], on_target[row], gripper, evaluate.suction)
            for row in range(len(tried))
        )
        return np.array(
            [
                weight_borne_n(one, frame, pose[:3, 3], evaluate)
                for one, frame in zip(limits, frames, strict=True)
            ]
        )

    def _borne_n(
        self, tried: Candidates, pose: Pose, surfaces: PosedScene, enough_n: float
    ) -> Float[np.ndarray, " n"]:
        """What the judge finds borne by each [N]; 0 where it holds another body or none.

        Poses after one that bears ``enough_n`` are not judged, and told as 0.
        """
        borne_n = np.zeros(len(tried))
        for row, frame in enumerate(tried.world_from_contact):
            found = self._judge.find_seal(frame, surfaces)
            if found is not None and found[0] == tried.body_id[row] and found[1].closes:
                borne_n[row] = weight_borne_n(found[1], frame, pose[:3, 3], self._config.evaluate)
            if borne_n[row] >= enough_n:
                break
        return borne_n


def likeliest_apart(
    tried: Candidates, expected_n: Float[np.ndarray, " n"], count: int, apart_m: float
) -> Int[np.ndarray, " k"]:
    """Choose the poses that may bear most, none near another: what is expected may be wrong there.

    Parameters
    ----------
    tried
        The poses.
    expected_n
        What each may bear, shape (n,) [N]; those of 0 are left out.
    count
        How many are wanted.
    apart_m
        Least distance between two of them [m].

    Returns
    -------
    Indices, the likeliest first, shape (k,), k ≤ count.
    """
    places_m = tried.world_from_contact[:, :3, 3]
    chosen: list[int] = []
    for row in np.argsort(-expected_n, kind="stable"):
        if len(chosen) == count or expected_n[row] <= 0.0:
            break
        if all(np.linalg.norm(places_m[row] - places_m[i]) >= apart_m for i in chosen):
            chosen.append(int(row))
    return np.array(chosen, dtype=np.int64)


def upward_surface(mesh: Mesh, world_from_object: Pose, body: int) -> VisibleSurface:
    """Points of a body that face up, as from far above without anything in between.

    Parameters
    ----------
    mesh
        Its surface in its own frame [m].
    world_from_object
        Its pose, shape (4, 4).
    body
        Its id.

    Returns
    -------
    The points in WCS.
    """
    own_points, own_normals = _points_of(mesh)
    normals = rotate_vectors(world_from_object, own_normals)
    up = normals[:, 2] > 0.0
    points = transform_points(world_from_object, own_points)[up]
    eye_m = world_from_object[:3, 3] + [0.0, 0.0, _ABOVE_M]
    every = np.ones(len(points), dtype=bool)
    return VisibleSurface(points, normals[up], np.full(len(points), body), eye_m, every)


def _from_all_sides(grasps: GraspsConfig) -> GraspsConfig:
    """Section grasps with contacts wherever the surface faces up."""
    return grasps.model_copy(update={"seen_angle_max_rad": np.pi / 2})


def _count(parts: list[Candidates]) -> int:
    return sum(len(part) for part in parts)


def _moved(before: Pose, now: Pose) -> bool:
    """Whether a body is elsewhere, or turned."""
    turn = np.linalg.norm(now[:3, :3] - before[:3, :3]) / np.sqrt(2)  # radians, for small ones
    return bool(np.linalg.norm(now[:3, 3] - before[:3, 3]) > _STILL_M or turn > _STILL_RAD)


def _radius_m(mesh: Mesh) -> float:
    """Of the smallest sphere about the mesh's origin that holds it [m]."""
    return float(np.linalg.norm(_points_of(mesh)[0], axis=1).max())


@lru_cache(maxsize=512)
def _points_of(mesh: Mesh) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Points spread evenly over a surface, and its normals there; the same at every call."""
    corners = mesh.vertices_m[mesh.faces]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(crossed, axis=1)
    rng = np.random.default_rng(0)
    # Evenly along the running sum of areas, so that points do not crowd by chance.
    steps = (np.arange(_POINTS) + rng.random(_POINTS)) / _POINTS
    faces = np.searchsorted(np.cumsum(doubled) / doubled.sum(), steps)
    faces = np.minimum(faces, len(doubled) - 1)
    u, v = np.sqrt(rng.random(_POINTS)), rng.random(_POINTS)
    weights = np.column_stack([1 - u, u * (1 - v), u * v])
    points = np.einsum("nk,nkj->nj", weights, corners[faces])
    return points, crossed[faces] / doubled[faces, None]
