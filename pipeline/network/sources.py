"""Sources of predicted quality: the released network, a network's file, the analytic baseline."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from pipeline.config.grasps import GripperConfig
from pipeline.errors import ArtifactError, ContentError
from pipeline.network.analytic import AnalyticBaseline
from pipeline.network.baselines import MonotoneRegressor
from pipeline.network.control_inference import ControlPredictor
from pipeline.network.released_files import BASELINE_FILE, DIGESTS_FILE, EXPORT_FILE

# What callers write in a network's place.
from pipeline.network.released_files import RELEASED as RELEASED
from pipeline.network.released_files import RELEASED_FOLDER as RELEASED_FOLDER

ANALYTIC = "analytic"

Predict = Callable[
    [Float[np.ndarray, "n g g 3"], Bool[np.ndarray, "n g g"]], Float[np.ndarray, " n"]
]


@dataclass(frozen=True)
class QualitySource:
    """Something that predicts the quality of clouds.

    Attributes
    ----------
    name
        Its name in messages.
    predict
        Clouds in units of r_G, shape (n, g, g, 3), and masks → q-hat, shape (n,).
    digest
        SHA-256 of the file it came from.
    """

    name: str
    predict: Predict
    digest: str


def quality_source(named: str, gripper: GripperConfig, threads: int) -> QualitySource:
    """Open a source: ``released``, ``analytic``, or the path of an exported network.

    Parameters
    ----------
    named
        One of the words, or a path of an ``.onnx`` file that stage train wrote.
    gripper
        Pad and physics, for the analytic baseline.
    threads
        Threads of the CPU, for a network.

    Returns
    -------
    The source.

    Raises
    ------
    ArtifactError
        The file is missing, or is no network of this project.
    """
    if named == ANALYTIC:
        data = _bytes(RELEASED_FOLDER / BASELINE_FILE)
        baseline = baseline_from_json(data.decode(), gripper)
        return QualitySource(ANALYTIC, baseline.predict, hashlib.sha256(data).hexdigest())
    path = RELEASED_FOLDER / EXPORT_FILE if named == RELEASED else Path(named)
    data = _bytes(path)
    try:
        predictor = ControlPredictor(data, threads)
    except ContentError as error:
        raise ArtifactError(f"{path}: {error.what}", error.remedy) from error
    name = "the released network" if named == RELEASED else path.name
    return QualitySource(name, predictor.predict, hashlib.sha256(data).hexdigest())


def released_baseline(gripper: GripperConfig) -> AnalyticBaseline:
    """The analytic baseline that is released with the network, for a gripper."""
    return baseline_from_json(_bytes(RELEASED_FOLDER / BASELINE_FILE).decode(), gripper)


def released_digests() -> dict[str, str]:
    """SHA-256 of each released file by its name, as the release wrote them down."""
    digests: dict[str, str] = json.loads((RELEASED_FOLDER / DIGESTS_FILE).read_text())
    return digests


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's content, as hexadecimal digits."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def baseline_to_json(baseline: AnalyticBaseline) -> str:
    """What was chosen on training samples, without pad and physics."""
    scale = baseline.scale.without_repeats()
    chosen = {
        "tolerance": baseline.tolerance,
        "smoothing": baseline.smoothing,
        "label": scale.feature.tolist(),
        "quality": scale.quality.tolist(),
    }
    return json.dumps(chosen, indent=1) + "\n"


def baseline_from_json(text: str, gripper: GripperConfig) -> AnalyticBaseline:
    """Read back `baseline_to_json`, for a gripper."""
    chosen = json.loads(text)
    scale = MonotoneRegressor(np.array(chosen["label"]), np.array(chosen["quality"]))
    return AnalyticBaseline(gripper, chosen["tolerance"], chosen["smoothing"], scale)


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise ArtifactError(
            f"{path} cannot be read: {error.strerror}",
            f"Give an exported network (runs/<run>/train/{EXPORT_FILE}), '{RELEASED}' or "
            f"'{ANALYTIC}'",
        ) from error
