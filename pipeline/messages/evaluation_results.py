"""What the attempts of an evaluation come to: by level, by policy, and policy against policy."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from google.protobuf.message import Message

from pipeline.artifacts.tensors import from_tensor
from pipeline.config.evaluation import PolicyName
from pipeline.control.success import Outcome, advantage, bootstrap_interval, success_rate
from pipeline.world.scene import ClutterScene
from schemas.softgrip.v1.evaluation_pb2 import Attempt, Comparison, LevelResult

ALL_LEVELS = 0  # stands for all levels together in a message


@dataclass(frozen=True)
class Results:
    """Attributes
    ----------
    levels
        Every policy at every level.
    policies
        Every policy over all levels (level 0).
    comparisons
        The first policy against each of the others.
    """

    levels: list[LevelResult]
    policies: list[LevelResult]
    comparisons: list[Comparison]

    def topics(self) -> dict[str, Sequence[Message]]:
        """The messages of evaluate's artifact by their topics."""
        return {
            "/levels": self.levels,
            "/policies": self.policies,
            "/comparisons": self.comparisons,
        }

    def summary(self) -> dict[str, object]:
        """The stage's headline figures; `success_by_level` is the first policy's."""
        first = self.policies[0]
        return {
            "attempts": first.attempts,
            "success_by_level": {
                str(r.level): _figures(r) for r in self.levels if r.policy == first.policy
            },
            "policies": {
                r.policy: {
                    **_figures(r),
                    "by_level": {
                        str(level.level): round(level.success_rate, 4)
                        for level in self.levels
                        if level.policy == r.policy
                    },
                }
                for r in self.policies
            },
            "comparisons": {
                c.baseline: {
                    "success": c.success_rate,
                    "baseline_success": c.baseline_success_rate,
                    "clutters": c.clutters,
                    "p_paired": c.p_paired,
                    "p_fisher": c.p_fisher,
                }
                for c in self.comparisons
            },
        }


# Nearly all bytes of an attempt: what recordings show and training can use, and no figure needs.
_FILM = (
    "time_s",
    "gripper_path",
    "object_paths",
    "base_wrench",
    "states",
    "joint_path",
    "pressure",
    "candidate_poses",
    "candidate_quality",
    "pictures",
    "seen",
    "contacts",
)


def without_film(attempts: Iterable[Attempt]) -> list[Attempt]:
    """Attempts without their paths, pictures and clouds: a few hundred bytes each in memory."""
    bare = []
    for made in attempts:
        for name in _FILM:
            made.ClearField(name)
        bare.append(made)
    return bare


def results_of(
    scenes: list[ClutterScene],
    policies: Sequence[PolicyName],
    attempts: list[Attempt],
    accelerations_m_s2: Sequence[float],
) -> Results:
    """Count what came of all attempts.

    Parameters
    ----------
    scenes
        The clutters.
    policies
        Those that tried them, the judged one first.
    attempts
        All of them.
    accelerations_m_s2
        Of the transport [m/s2].

    Returns
    -------
    Figures by level, over all levels, and of the first policy against each other.
    """
    levels = sorted({scene.level for scene in scenes})
    by_level = [
        _result(
            policy, level, [s for s in scenes if s.level == level], attempts, accelerations_m_s2
        )
        for policy in policies
        for level in levels
    ]
    overall = [
        _result(policy, ALL_LEVELS, scenes, attempts, accelerations_m_s2) for policy in policies
    ]
    first, *others = policies
    comparisons = [_comparison(first, other, scenes, attempts) for other in others]
    return Results(by_level, overall, comparisons)


def _result(
    policy: PolicyName,
    level: int,
    scenes: list[ClutterScene],
    attempts: list[Attempt],
    accelerations_m_s2: Sequence[float],
) -> LevelResult:
    """One policy on some clutters, with its 95 % interval and the causes of its failures."""
    ids = {scene.scene_id for scene in scenes}
    mine = [made for made in attempts if made.policy == policy and made.scene_id in ids]
    lifted = sum(made.outcome == "lifted" for made in mine)
    by_scene = Counter(made.scene_id for made in mine if made.outcome == "lifted")
    rate, low, high = success_rate(lifted, len(mine))
    around = bootstrap_interval(
        [made.outcome == "lifted" for made in mine],
        [made.scene_id for made in mine],
        [made.target for made in mine],
    )
    carried = {
        f"{acceleration:g}": sum(made.carried_m_s2 >= acceleration for made in mine)
        for acceleration in accelerations_m_s2
    }
    time_s = sum(made.duration_s for made in mine)
    could = could_be_lifted(mine)
    return LevelResult(
        policy=policy,
        level=level,
        attempts=len(mine),
        lifted=lifted,
        objects=sum(len(scene.objects) for scene in scenes),
        clutters=len(scenes),
        cleared=sum(by_scene[scene.scene_id] == len(scene.objects) for scene in scenes),
        success_rate=rate,
        interval_low=min(low, around[0]),
        interval_high=max(high, around[1]),
        failures=Counter(made.cause for made in mine if made.outcome != "lifted"),
        seconds_a_pick=time_s / lifted if lifted else 0.0,
        picks_an_hour=3600 * lifted / time_s if time_s else 0.0,
        seals=sum(made.seals for made in mine),
        lifted_at_first_seal=sum(made.outcome == "lifted" and made.seals == 1 for made in mine),
        carried=carried,
        liftable=could.objects,
        attempts_at_liftable=could.attempts,
        lifted_unforeseen=could.unforeseen,
    )


@dataclass(frozen=True)
class CouldBeLifted:
    """What could be lifted at all, by the ceilings that attempts tell.

    Attributes
    ----------
    objects
        Objects that some pose could lift as they lay before some attempt, or that were lifted.
    attempts
        Attempts at an object that could be lifted as it lay then, or was; of those that met none,
        the ones with such an object on the table.
    unforeseen
        Objects that were lifted, though no pose that was tried could.
    """

    objects: int = 0
    attempts: int = 0
    unforeseen: int = 0


def could_be_lifted(attempts: Sequence[Attempt]) -> CouldBeLifted:
    """Count what one policy could have lifted.

    Parameters
    ----------
    attempts
        All of the policy's, at any clutters.

    Returns
    -------
    The counts; all 0 where ceilings were not looked for.
    """
    objects: set[tuple[str, int]] = set()
    count = unforeseen = 0
    for made in attempts:
        if not made.HasField("ceilings_n"):
            continue
        borne_n, weight_n = from_tensor(made.ceilings_n).T
        can = borne_n >= weight_n  # NaN, of what is gone, is not
        objects |= {(made.scene_id, int(i) + 1) for i in np.flatnonzero(can)}
        foreseen = bool(can[made.target_body - 1] if made.target_body else can.any())
        lifted = made.outcome == "lifted"
        if lifted:
            objects.add((made.scene_id, made.target_body))
        count += foreseen or lifted
        unforeseen += lifted and not foreseen
    return CouldBeLifted(len(objects), count, unforeseen)


def _comparison(
    policy: PolicyName, baseline: PolicyName, scenes: list[ClutterScene], attempts: list[Attempt]
) -> Comparison:
    ours, theirs = (
        [_outcome(name, scene, attempts) for scene in scenes] for name in (policy, baseline)
    )
    found = advantage(ours, theirs)
    return Comparison(
        policy=policy,
        baseline=baseline,
        clutters=len(scenes),
        success_rate=found.rate,
        baseline_success_rate=found.baseline_rate,
        p_paired=found.p_paired,
        p_fisher=found.p_fisher,
    )


def _outcome(policy: PolicyName, scene: ClutterScene, attempts: list[Attempt]) -> Outcome:
    mine = [a for a in attempts if a.policy == policy and a.scene_id == scene.scene_id]
    return Outcome(sum(a.outcome == "lifted" for a in mine), len(mine))


def _figures(result: LevelResult) -> dict[str, object]:
    return {
        "rate": result.success_rate,
        "interval_95": [result.interval_low, result.interval_high],
        "lifted": result.lifted,
        "attempts": result.attempts,
        "cleared": result.cleared,
        "clutters": result.clutters,
        "failures": dict(sorted(result.failures.items())),
        "seconds_a_pick": round(result.seconds_a_pick, 3),
        "picks_an_hour": round(result.picks_an_hour, 1),
        "success_at_first_seal": result.lifted_at_first_seal / max(result.attempts, 1),
        "seals_an_object": result.seals / result.lifted if result.lifted else None,
        "carried": dict(sorted(result.carried.items(), key=lambda one: float(one[0]))),
        **_of_what_can_be_lifted(result),
    }


def _of_what_can_be_lifted(result: LevelResult) -> dict[str, object]:
    """Against the ceiling; nothing where that was not looked for."""
    if result.liftable == 0:
        return {}
    return {
        "objects_that_can_be_lifted": result.liftable,
        "lifted_of_these": result.lifted / result.liftable,
        "attempts_at_these": result.attempts_at_liftable,
        "success_at_these": result.lifted / max(result.attempts_at_liftable, 1),
        "lifted_unforeseen": result.lifted_unforeseen,
    }
