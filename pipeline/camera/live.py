"""Grasps of a stream of pictures, each within the time between two of them.

What `propose_grasps` does for one scene in a second is done here for every picture: the support
is kept from picture to picture, pictures are thinned, and fewer contacts are tried.
"""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

import numpy as np

from pipeline.camera.bags import RecordedPicture
from pipeline.camera.frame import Frame
from pipeline.camera.frame_support import support_of
from pipeline.camera.proposals import Proposals, apart, clear_of_support
from pipeline.camera.support import Support, stands_out
from pipeline.config import RunConfig
from pipeline.control.candidates import candidates_at
from pipeline.control.clearance import free_of_collision
from pipeline.control.cloud import DepthPicture, merged_cloud
from pipeline.control.ranking import Ranking
from pipeline.geometry.transforms import invert
from pipeline.world.cameras import points_of_depth, thinned

PLANE_EVERY_PX = 8  # some thousand pixels tell whether the support is still where it was
T = TypeVar("T")


@dataclass
class Parts:
    """Seconds that each part of one answer took."""

    seconds: dict[str, float] = field(default_factory=dict)
    _last: float = field(default_factory=time.perf_counter)

    def done(self, part: str) -> None:
        """The time since the last part ended was spent on this one."""
        now = time.perf_counter()
        self.seconds[part] = self.seconds.get(part, 0.0) + now - self._last
        self._last = now


class LiveGrasps:
    """Proposes grasps on picture after picture of one camera."""

    def __init__(self, ranking: Ranking, config: RunConfig) -> None:
        self._ranking = ranking
        self._config = config
        self._support: Support | None = None
        self._share = 0.0
        self.found_anew = 0

    def propose(self, frame: Frame, rng: np.random.Generator, parts: Parts) -> Proposals:
        """The best grasps of one picture.

        Parameters
        ----------
        frame
            The picture.
        rng
            Draws contacts.
        parts
            Is told what each part took.

        Returns
        -------
        At most ``predict.live.top`` grasps in the frame's world, the best first.

        Raises
        ------
        PictureError
            No support was found.
        """
        config, settings = self._config, self._config.predict
        support = self._kept_support(frame, rng)
        parts.done("support")
        level = support.world_from_support
        moved = frame.moved(invert(level))
        policy = config.evaluate.policy
        thin = _thinned(moved, settings.live.cloud_every_px)
        cloud = merged_cloud([thin], policy.voxel_m, policy.above_table_m)
        objects = cloud.take(stands_out(support, cloud.points_m, cloud.eye_m, settings))
        parts.done("cloud")
        if len(objects) == 0:
            return _nothing(support)
        at = rng.integers(len(objects), size=settings.live.candidates)
        found = candidates_at(
            objects,
            objects.points_m[at],
            objects.eye_m[at],
            config.grasps.normal_radius_m,
            settings.tilt_max_rad,
        )
        free = free_of_collision(found.world_from_contact, cloud.points_m, config.evaluate.hand)
        free &= clear_of_support(
            found.world_from_contact,
            config.gripper.pad.radius_m,
            config.evaluate.hand,
            settings.above_support_m,
        )
        found = found.take(free)
        parts.done("contacts")
        if len(found) == 0:
            return _nothing(support)
        quality = self._ranking([_thinned(moved, settings.live.every_px)], found)
        parts.done("ranking")
        kept = apart(found.world_from_contact[:, :3, 3], quality, settings.apart_m)
        best = kept[: settings.live.top]
        parts.done("choice")
        return Proposals(
            world_from_contact=level @ found.world_from_contact[best],
            quality=quality[best],
            roughness_m=found.roughness_m[best],
            instance=np.zeros(len(best), dtype=np.int64),
            support=support,
            left_out={},
        )

    def _kept_support(self, frame: Frame, rng: np.random.Generator) -> Support:
        """The support of the picture before, as long as as much of this one lies on it."""
        if self._support is not None:
            enough = self._config.predict.live.support_kept_share * self._share
            if self._on_plane(frame, self._support) >= enough:
                return self._support
        found = support_of([frame], self._config, rng)
        self._support, self._share = found, self._on_plane(frame, found)
        self.found_anew += 1
        return found

    def _on_plane(self, frame: Frame, support: Support) -> float:
        """Share of a picture's points that lie on a support."""
        to_support = invert(support.world_from_support)
        camera = replace(
            frame.camera, world_from_camera=to_support @ frame.camera.world_from_camera
        )
        points, _, _ = points_of_depth(frame.depth_m, camera, PLANE_EVERY_PX)
        distance_m = np.linalg.norm(points - camera.world_from_camera[:3, 3], axis=1)
        near = np.abs(points[:, 2]) <= self._config.predict.support.tolerance * distance_m
        return float(near.mean()) if len(points) else 0.0


@dataclass(frozen=True)
class Answered(Generic[T]):
    """One picture that was answered, in recorded time.

    Attributes
    ----------
    time_ns
        When the picture was recorded [ns].
    answer
        What came of it.
    seconds
        From the picture to the answer.
    skipped
        Pictures that came while it was worked on.
    """

    time_ns: int
    answer: T
    seconds: float
    skipped: int


def in_recorded_time(
    pictures: Iterable[RecordedPicture],
    answer: Callable[[RecordedPicture], T],
    clock: Callable[[], float] = time.perf_counter,
) -> Iterator[Answered[T]]:
    """Answer pictures as if they came now: those that come too soon are skipped.

    Parameters
    ----------
    pictures
        In the order of their times.
    answer
        Decodes and answers one.
    clock
        Tells seconds.

    Yields
    ------
    Answered[T]
        Each picture that was answered.
    """
    free_at_ns = -np.inf
    last: Answered[T] | None = None
    for picture in pictures:
        if last is not None and picture.time_ns < free_at_ns:
            last = replace(last, skipped=last.skipped + 1)
            continue
        if last is not None:
            yield last
        began = clock()
        result = answer(picture)
        took = clock() - began
        free_at_ns = picture.time_ns + 1e9 * took
        last = Answered(picture.time_ns, result, took, 0)
    if last is not None:
        yield last


def _thinned(frame: Frame, every: int) -> DepthPicture:
    """The picture of every n-th pixel a side."""
    return DepthPicture(
        np.ascontiguousarray(frame.depth_m[::every, ::every]), thinned(frame.camera, every)
    )


def _nothing(support: Support) -> Proposals:
    none = np.empty(0)
    return Proposals(np.empty((0, 4, 4)), none, none, np.empty(0, dtype=np.int64), support, {})
