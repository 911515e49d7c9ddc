"""Attempts of the closed loop, read as episodes."""

from pathlib import Path

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.errors import ArtifactError
from pipeline.interchange.lerobot import Episode, StepPicture
from schemas.softgrip.v1.evaluation_pb2 import Attempt


def read_episodes(evaluate: Path, policy: str) -> list[Episode]:
    """Every attempt of a policy, as an episode.

    Parameters
    ----------
    evaluate
        Artifact of stage evaluate.
    policy
        Its name, such as ``closed-loop``.

    Returns
    -------
    The attempts in the order of the artifact.

    Raises
    ------
    ArtifactError
        The artifact is missing or damaged, the policy made no attempt, or an older program made
        them, which kept no picture of each step.
    """
    found = []
    with open_artifact(evaluate) as artifact:
        for _, attempt in artifact.messages(Attempt):
            time_s = from_tensor(attempt.time_s)
            if attempt.policy != policy or len(time_s) == 0:
                continue
            if not attempt.seen:
                raise ArtifactError(
                    f"{evaluate}: attempt {attempt.attempt} of {attempt.scene_id} keeps no "
                    "pictures of its steps: an older program made it",
                    "Make the attempts again: make eval",
                )
            found.append(
                Episode(
                    name=f"{attempt.scene_id}, attempt {attempt.attempt}",
                    time_s=time_s,
                    world_from_gripper=from_tensor(attempt.gripper_path),
                    wrench=from_tensor(attempt.base_wrench),
                    pressure=from_tensor(attempt.pressure),
                    pictures=[
                        StepPicture(
                            one.camera,
                            one.step,
                            from_tensor(one.depth_mm),
                            (one.top_px, one.left_px),
                            (one.whole_height_px, one.whole_width_px),
                        )
                        for one in attempt.seen
                    ],
                    success=attempt.outcome == "lifted",
                    quality=attempt.predicted_quality,
                )
            )
    if not found:
        raise ArtifactError(
            f"{evaluate} holds no attempt of {policy}", "Name it under evaluate.policies"
        )
    return found
