"""What an imperfect robot believes: cameras calibrated a little wrong, a wrench with errors.

`evaluate.imperfection` holds the size of each error. A `Calibration` is drawn once for a clutter
and held; a `WrenchSensor` draws the noise of every reading, and what is left of its offset every
time it is tared. All draws are of unit spread and then multiplied, so that twice the scale is twice
each error.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from pipeline.config import RunConfig
from pipeline.config.imperfection import ImperfectionConfig
from pipeline.geometry.compiled_poses import turned
from pipeline.read_only import read_only


@dataclass(frozen=True, eq=False)
class Calibration:
    """Errors that stay as they are.

    Attributes
    ----------
    wrench_bias
        Offset of the wrench before it is tared: force [N] and moment [N m] in GCS, shape (6,).
    hand_eye
        camera_from_believed of the wrist's camera, shape (4, 4).
    beside
        camera_from_believed of each camera beside the table, shape (n, 4, 4).
    """

    wrench_bias: Float[np.ndarray, " 6"]
    hand_eye: Float[np.ndarray, "4 4"]
    beside: Float[np.ndarray, "n 4 4"]

    def __post_init__(self) -> None:
        for name in ("wrench_bias", "hand_eye", "beside"):
            object.__setattr__(self, name, read_only(getattr(self, name)))


def draw_calibration(
    config: ImperfectionConfig, cameras_beside: int, rng: np.random.Generator
) -> Calibration:
    """Draw the errors of one calibration.

    Parameters
    ----------
    config
        Size of each error, and the factor over all.
    cameras_beside
        Number of cameras beside the table.
    rng
        Draws them.

    Returns
    -------
    The errors; none where the factor is 0.
    """
    bias = config.scale * _spreads(config.force_bias_n, config.moment_bias_nm)
    wrench_bias = bias * rng.standard_normal(6)
    hand_eye = _pose_error(config.scale, config.hand_eye_m, config.hand_eye_rad, rng)
    beside = [
        _pose_error(config.scale, config.camera_m, config.camera_rad, rng)
        for _ in range(cameras_beside)
    ]
    return Calibration(wrench_bias, hand_eye, np.array(beside).reshape(-1, 4, 4))


def with_imperfection(config: RunConfig, scale: float) -> RunConfig:
    """The run's configuration with another factor over the robot's errors."""
    imperfection = config.evaluate.imperfection.model_copy(update={"scale": scale})
    evaluate = config.evaluate.model_copy(update={"imperfection": imperfection})
    return config.model_copy(update={"evaluate": evaluate})


class WrenchSensor:
    """Reads a wrench with an offset and noise, and a vacuum with noise."""

    def __init__(
        self,
        config: ImperfectionConfig,
        bias: Float[np.ndarray, " 6"],
        rng: np.random.Generator,
    ) -> None:
        """Start without being tared.

        Parameters
        ----------
        config
            Size of each error, and the factor over all.
        bias
            Offset until it is tared first: force [N] and moment [N m], shape (6,).
        rng
            Draws noise, and what taring leaves.
        """
        self._left = config.scale * _spreads(config.force_tare_n, config.moment_tare_nm)
        self._noise = config.scale * _spreads(config.force_noise_n, config.moment_noise_nm)
        self._offset = bias
        self._rng = rng
        self._vacuum = config.scale * config.vacuum_noise

    def tare(self) -> None:
        """Set the present reading, without a load, to zero; a new and smaller offset is left."""
        self._offset = self._left * self._rng.standard_normal(6)

    def error(self) -> Float[np.ndarray, " 6"]:
        """What one reading differs from the truth by: force [N] and moment [N m], shape (6,)."""
        return self._offset + self._noise * self._rng.standard_normal(6)

    def vacuum_error(self) -> float:
        """What one vacuum that is read differs from the truth by, over the pump's greatest."""
        return self._vacuum * float(self._rng.standard_normal())


def _spreads(force_n: float, moment_nm: float) -> Float[np.ndarray, " 6"]:
    return np.repeat([force_n, moment_nm], 3)


def _pose_error(
    scale: float, place_m: float, turn_rad: float, rng: np.random.Generator
) -> Float[np.ndarray, "4 4"]:
    """A small motion: a place and a rotation vector, each normally distributed by axis."""
    place, turn = scale * place_m * rng.standard_normal(3), turn_rad * rng.standard_normal(3)
    error = np.asarray(turned(np.eye(4), scale * turn))
    error[:3, 3] = place
    return error
