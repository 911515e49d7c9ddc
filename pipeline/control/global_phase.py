"""The global phase: take pictures, sample contacts, rank them, choose the best that can be reached.

Objects that only the colour pictures show, such as transparent ones, rank below all measured
contacts, because the gripper has to go down on them until it touches.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.config.evaluation import EvaluateConfig
from pipeline.control.candidates import (
    FEWEST_POINTS,
    Candidates,
    sample_candidates,
    sample_near,
)
from pipeline.control.clearance import free_of_collision
from pipeline.control.cloud import Cloud, DepthPicture, merged_cloud
from pipeline.control.decision import Cause, Decision, Strategy, TriedContact
from pipeline.control.felt import led_by_feeling, tried_already
from pipeline.control.regrasp import top_of_column_m, worth_with_lever
from pipeline.control.robot import Eyes, Robot
from pipeline.control.unseen import unseen_contacts
from pipeline.control.viewpoints import (
    back_off,
    choose_apart,
    gripper_above,
    turn_camera_up,
    turn_half_about_approach,
    turn_least,
)

Pose = Float[np.ndarray, "4 4"]
Travel = Callable[[Pose], Cause | None]


@dataclass(frozen=True, eq=False)
class Choice:
    """A contact to aim at.

    Attributes
    ----------
    world_from_contact
        Its frame, shape (4, 4).
    quality
        Its q-hat; 0 where it was not measured.
    normal_radius_m
        Radius over which its normal was measured [m]; 0 where it was not.
    unmeasured
        Whether its height is not measured, so that the pad goes down until it touches.
    """

    world_from_contact: Pose
    quality: float
    normal_radius_m: float = 0.0
    unmeasured: bool = False


class GlobalPhase:
    """The contacts to aim at in one attempt, ranked from the latest pictures."""

    def __init__(
        self,
        eyes: Eyes,
        robot: Robot,
        strategy: Strategy,
        config: EvaluateConfig,
        normal_radius_m: float,
        rng: np.random.Generator,
        avoid_m: Sequence[Float[np.ndarray, " 3"]],
        felt: Sequence[TriedContact] = (),
    ) -> None:
        """Store the arguments; no picture is taken yet.

        Parameters
        ----------
        eyes
            The cameras.
        robot
            Reports its pose and which poses it can reach.
        strategy
            Gives the ranking.
        config
            Settings of the policy and the rigid parts of the gripper.
        normal_radius_m
            Radius over which a contact's normal is measured [m].
        rng
            Generator of the candidates.
        avoid_m
            Contacts in WCS that failed in earlier attempts [m], each of shape (3,); places near
            them are tried only where nothing else is left.
        felt
            Seals of earlier attempts that failed, and at which the vacuum was felt: the order goes
            by that, and just these contacts are not tried again while there is another.
        """
        self._eyes = eyes
        self._robot = robot
        self._ranking = strategy.ranking
        self._config = config
        self._policy = config.policy
        self._normal_radius_m = normal_radius_m
        self._rng = rng
        self._felt = list(felt)
        places = [seal.world_from_contact[:3, 3] for seal in felt]
        self._avoid_m = [a for a in avoid_m if not any(np.array_equal(a, b) for b in places)]
        self._free: tuple[Candidates, Float[np.ndarray, " k"]] | None = None
        self._unmeasured: list[Choice] = []
        self._rejected_m: list[Float[np.ndarray, " 3"]] = []
        self._ranked: list[Choice] = []

    def look(self, decision: Decision, travel: Travel | None) -> Cause | None:
        """Take pictures and rank the contacts in them.

        Parameters
        ----------
        decision
            Receives the pictures, the candidates and their quality.
        travel
            Moves the gripper so that the wrist's camera is above promising places; None: only the
            cameras beside the table are used.

        Returns
        -------
        None where there is a contact to aim at, otherwise why there is none.
        """
        pictures = self._eyes.static()
        if pictures is None:
            return Cause.CAMERA_STOPPED
        if travel is not None:
            more = self._look_closer(pictures, travel)
            if isinstance(more, Cause):
                return more
            pictures = [*pictures, *more]
        cloud, unseen = self._cloud(pictures), self._unseen_contacts(pictures)
        if len(cloud) == 0 and len(unseen) == 0:
            return Cause.EMPTY_CLOUD
        decision.pictures = pictures
        found, quality = self._rated(cloud, pictures)
        decision.candidates, decision.quality = found.world_from_contact, quality
        free = free_of_collision(found.world_from_contact, cloud.points_m, self._config.hand)
        self._free = found.take(free), quality[free]
        self._unmeasured = self._rank_unmeasured(cloud, unseen)
        self._rank()
        return None if self._ranked else Cause.NO_CANDIDATE

    def feel(self, seal: TriedContact) -> None:
        """Rank the contacts anew after a seal that failed, by the vacuum that was felt there."""
        self._felt.append(seal)
        self._rank()

    def _rank(self) -> None:
        """Put the contacts in order, the most worth first; those tried already come last."""
        assert self._free is not None  # a look comes first
        found, quality = self._free
        worth = led_by_feeling(found.world_from_contact, quality, self._felt, self._policy)
        again = tried_already(found.world_from_contact, self._felt, self._policy)
        order = np.lexsort((-worth, again))
        self._ranked = [*_choices(found, quality, order), *self._unmeasured]

    def best(self, least: float) -> Choice | None:
        """The best reachable contact of at least this quality that was not rejected, or None."""
        return self._first_of(self._ranked, least)

    def better_than(self, aim: Pose, quality: float) -> Choice | None:
        """The best contact of at least this quality away from ``aim``; None where there is none.

        Where one is returned, the surroundings of ``aim`` are rejected for the rest of the attempt.
        """
        self._rejected_m.append(aim[:3, 3])
        choice = self.best(quality)
        if choice is None:
            self._rejected_m.pop()
        return choice

    def turned(self, contact: Pose) -> Pose:
        """A contact turned about its approach: the wrist turns little, its camera stays up."""
        hand = self._config.hand
        least = turn_least(contact, self._robot.pose())
        return turn_camera_up(least, hand.camera_aside_m, hand.camera_above_m)

    def reject(self, places_m: Sequence[Float[np.ndarray, " 3"]]) -> None:
        """Exclude the surroundings of these contacts, in WCS [m], for the rest of the attempt."""
        self._rejected_m += places_m

    def nearer_to(
        self,
        place_m: Float[np.ndarray, " 2"],
        lever_m: float,
        pictures: Sequence[DepthPicture],
    ) -> Choice | None:
        """The best contact that is nearer to the vertical line through a load's centre.

        Parameters
        ----------
        place_m
            Horizontal place of the load's centre of mass in WCS [m], shape (2,).
        lever_m
            Horizontal lever of the contact that did not hold [m].
        pictures
            Depth images to sample contacts from.

        Returns
        -------
        The contact; None where none is nearer, free of collision and reachable.
        """
        cloud = self._cloud(pictures)
        top = top_of_column_m(cloud, place_m, self._policy.regrasp_column_m)
        if top is None:
            return None
        found = self._without_failed(self._sample_near(cloud, top))
        if len(found) == 0:
            return None
        quality = self._ranking(pictures, found)
        self._robot.think()
        worth = worth_with_lever(quality, found, place_m, lever_m, self._policy)
        nearer = worth > 0.0
        ranked = self._rank_free(
            cloud, found.take(nearer), quality[nearer], best_first=worth[nearer]
        )
        return self._first_of(ranked, least=0.0)

    def _rated(
        self, cloud: Cloud, pictures: Sequence[DepthPicture]
    ) -> tuple[Candidates, Float[np.ndarray, " k"]]:
        """Candidates and their q-hat; more of them where none promises enough."""
        found = self._without_failed(self._sample(cloud))
        quality = self._ranking(pictures, found) if len(found) else np.empty(0)
        self._robot.think()
        more, steepest = self._policy.more_candidates, self._policy.steepest_rad
        if more == 0 or quality.max(initial=0.0) >= self._policy.enough_quality:
            return found, quality
        # All are rated again: each is averaged with its neighbours, and now it has some.
        lean, usual_m = self._policy.lean_rad, self._normal_radius_m
        for count, radius_m in (
            (more - more // 2, usual_m),
            (more // 2, self._policy.wide_normal_m),
        ):
            fewest = round(FEWEST_POINTS * (radius_m / usual_m) ** 2)  # as dense a surface
            some = sample_candidates(cloud, count, radius_m, steepest, self._rng, lean, fewest)
            found = found.joined(self._without_failed(some))
        quality = self._ranking(pictures, found) if len(found) else np.empty(0)
        self._robot.think()
        return found, quality

    def _look_closer(
        self, pictures: Sequence[DepthPicture], travel: Travel
    ) -> list[DepthPicture] | Cause:
        """Take pictures with the wrist's camera above the places of highest q-hat.

        Pictures that are left over are taken of objects that depth does not show, two of each from
        opposite sides: the errors of the two outlines are then opposite, and their mean is the
        object's middle.
        """
        found = self._without_failed(self._sample(self._cloud(pictures)))
        quality = self._ranking(pictures, found) if len(found) else np.empty(0)
        self._robot.think()
        places = found.world_from_contact[:, :3, 3]
        wanted = self._policy.wrist_views
        apart = choose_apart(places, quality, wanted, self._policy.look_apart_m)
        here = self._robot.pose()
        looks = [(place, here) for place in apart]
        for contact in self._unseen_contacts(pictures)[: wanted - len(looks)]:
            looks += [(contact[:3, 3], here), (contact[:3, 3], turn_half_about_approach(here))]
        more = []
        for place, heading in looks:
            pose = gripper_above(place, self._policy.wrist_view_m, heading)
            if not self._robot.reachable(pose):
                continue
            if travel(pose) is not None:
                continue  # the gripper touched something on the way: leave this place out
            picture = self._eyes.wrist(place, self._policy.wrist_view_m / 2)
            if picture is None:
                return Cause.CAMERA_STOPPED
            more.append(picture)
        return more

    def _first_of(self, ranked: Sequence[Choice], least: float) -> Choice | None:
        for choice in ranked:
            if choice.quality < least:
                continue
            place = choice.world_from_contact[:3, 3]
            distance = [np.linalg.norm(place - aim) for aim in self._rejected_m]
            if min(distance, default=np.inf) < self._policy.another_m:
                continue
            if self._can_reach(self.turned(choice.world_from_contact)):
                return choice
        return None

    def _rank_free(
        self,
        cloud: Cloud,
        found: Candidates,
        quality: Float[np.ndarray, " k"],
        best_first: Float[np.ndarray, " k"],
    ) -> list[Choice]:
        """Candidates at which the stem touches no measured point, the best first."""
        poses = found.world_from_contact
        free = free_of_collision(poses, cloud.points_m, self._config.hand)
        order = np.argsort(-best_first, kind="stable")
        return _choices(found, quality, order[free[order]])

    def _rank_unmeasured(self, cloud: Cloud, contacts: Sequence[Pose]) -> list[Choice]:
        """Unmeasured contacts that the stem can reach without touching a measured point.

        Those near contacts that failed before come last.
        """
        poses = np.array(contacts).reshape(-1, 4, 4)
        free = free_of_collision(poses, cloud.points_m, self._config.hand)
        order = np.argsort(~self._not_failed(poses[:, :3, 3]), kind="stable")
        return [Choice(poses[i], 0.0, unmeasured=True) for i in order if free[i]]

    def _cloud(self, pictures: Sequence[DepthPicture]) -> Cloud:
        return merged_cloud(pictures, self._policy.voxel_m, self._policy.above_table_m)

    def _unseen_contacts(self, pictures: Sequence[DepthPicture]) -> list[Pose]:
        return unseen_contacts(pictures, self._policy.unseen, self._policy.above_table_m)

    def _sample(self, cloud: Cloud) -> Candidates:
        return sample_candidates(
            cloud,
            self._policy.candidates,
            self._normal_radius_m,
            self._policy.tilt_max_rad,
            self._rng,
        )

    def _sample_near(self, cloud: Cloud, place_m: Float[np.ndarray, " 3"]) -> Candidates:
        return sample_near(
            cloud,
            place_m,
            self._policy.regrasp_radius_m,
            self._policy.local_candidates,
            self._normal_radius_m,
            self._policy.tilt_max_rad,
            self._rng,
        )

    def _without_failed(self, found: Candidates) -> Candidates:
        """Candidates that are not near a contact that failed before; all where none is left."""
        fresh = self._not_failed(found.world_from_contact[:, :3, 3])
        return found.take(fresh) if fresh.any() else found

    def _not_failed(self, places_m: Float[np.ndarray, "k 3"]) -> Bool[np.ndarray, " k"]:
        fresh = np.ones(len(places_m), dtype=bool)
        for contact in self._avoid_m:
            distance = np.linalg.norm(places_m - contact, axis=1)
            fresh &= distance > self._policy.avoid_radius_m
        return fresh

    def _can_reach(self, contact: Pose) -> bool:
        above = back_off(contact, self._policy.standoff_m)
        return self._robot.reachable(above) and self._robot.reachable(contact)


def _choices(
    found: Candidates, quality: Float[np.ndarray, " k"], order: Int[np.ndarray, " j"]
) -> list[Choice]:
    """Candidates as choices, in an order."""
    return [
        Choice(found.world_from_contact[i], float(quality[i]), float(found.normal_radius_m[i]))
        for i in order
    ]
