"""What rates grasps in control, read from a training's artifact or given beside a run."""

from functools import lru_cache
from pathlib import Path

from pipeline.artifacts import open_artifact
from pipeline.config import RunConfig
from pipeline.config.evaluation import PolicyName
from pipeline.config.grasps import GripperConfig
from pipeline.control.ranking import Predict, join_predictions
from pipeline.messages.training import BASELINE, EXPORT
from pipeline.network.analytic import AnalyticBaseline
from pipeline.network.control_inference import ControlPredictor
from pipeline.network.sources import baseline_from_json, released_baseline

SCORE_THREADS = 1  # clutters run side by side, a worker a core


def rates_for(policy: PolicyName, path: Path, config: RunConfig) -> Predict:
    """What rates grasps for a policy: the network, the baseline, or both joined.

    Parameters
    ----------
    policy
        Name of the policy.
    path
        A train artifact, or an exported network (.onnx).
    config
        Section gripper for the baseline; `evaluate.policy.analytic_share` joins both.

    Returns
    -------
    Clouds and masks to q-hat.
    """
    share = {"network": 0.0, "analytic": 1.0}.get(policy, config.evaluate.policy.analytic_share)
    if share == 0.0:
        return control_predictor(path).predict
    analytic = fitted_baseline(path, config.gripper).predict
    if share == 1.0:
        return analytic
    return join_predictions(control_predictor(path).predict, analytic, share)


@lru_cache(maxsize=1)
def control_predictor(path: Path) -> ControlPredictor:
    """The network as exported for control, of a train artifact or given; read once a worker."""
    if path.suffix == ".onnx":
        return ControlPredictor(path.read_bytes(), SCORE_THREADS)
    with open_artifact(path) as artifact:
        return ControlPredictor(artifact.attachment(EXPORT), SCORE_THREADS)


def fitted_baseline(path: Path, gripper: GripperConfig) -> AnalyticBaseline:
    """The analytic baseline as a training fitted it; beside a given network, the released one."""
    if path.suffix == ".onnx":
        return released_baseline(gripper)
    with open_artifact(path) as artifact:
        return baseline_from_json(artifact.attachment(BASELINE).decode(), gripper)
