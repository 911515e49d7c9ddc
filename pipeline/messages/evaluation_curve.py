"""Success over the size of a robot's errors: the same clutters at several scales."""

from collections.abc import Mapping, Sequence

from pipeline.config.evaluation import PolicyName
from pipeline.messages.evaluation_results import results_of
from pipeline.world.scene import ClutterScene
from schemas.softgrip.v1.evaluation_pb2 import Attempt, LevelResult


def curve_scenes(scenes: Sequence[ClutterScene], a_level: int) -> list[ClutterScene]:
    """The first clutters of each level, so many of each, in their order."""
    taken: list[ClutterScene] = []
    for scene in scenes:
        if sum(other.level == scene.level for other in taken) < a_level:
            taken.append(scene)
    return taken


def curve_of(
    scenes: list[ClutterScene],
    policies: Sequence[PolicyName],
    attempts: Mapping[float, list[Attempt]],
    accelerations_m_s2: Sequence[float],
) -> list[LevelResult]:
    """Count what came of all attempts at each scale.

    Parameters
    ----------
    scenes
        The clutters, the same at every scale.
    policies
        Those that tried them.
    attempts
        All attempts by the scale of the robot's errors.
    accelerations_m_s2
        Of the transport [m/s2].

    Returns
    -------
    Each policy over all levels, at each scale.
    """
    found = []
    for scale, made in attempts.items():
        for result in results_of(scenes, policies, made, accelerations_m_s2).policies:
            result.imperfection_scale = scale
            found.append(result)
    return found


def curve_figures(curve: Sequence[LevelResult]) -> dict[str, dict[str, dict[str, object]]]:
    """Policy, then scale, to the rate of success with its 95 % interval."""
    figures: dict[str, dict[str, dict[str, object]]] = {}
    for point in curve:
        figures.setdefault(point.policy, {})[f"{point.imperfection_scale:g}"] = {
            "rate": point.success_rate,
            "interval_95": [point.interval_low, point.interval_high],
            "lifted": point.lifted,
            "attempts": point.attempts,
            "clutters": point.clutters,
            "seconds_a_pick": round(point.seconds_a_pick, 3),
            "failures": dict(sorted(point.failures.items())),
        }
    return figures
