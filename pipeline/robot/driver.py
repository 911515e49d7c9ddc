"""What a person writes for an arm of their own: nine calls of its libraries."""

from typing import Protocol

import numpy as np
from jaxtyping import Float


class Driver(Protocol):
    """An arm with a depth camera on the wrist, cameras beside the table, and a vacuum.

    Poses are 4x4, in metres, in the arm's own base. All that turns them into the table's world and
    into the pad's frame is calibration (`pipeline.robot.calibration`).
    """

    period_s: float
    """Time between two setpoints [s]; the shorter, the softer the pad meets an object."""

    def base_from_flange(self) -> Float[np.ndarray, "4 4"]:
        """Measured pose of the flange."""
        ...

    def reachable(self, base_from_flange: Float[np.ndarray, "4 4"]) -> bool:
        """Whether joint angles within their limits reach a pose, and nothing is hit there."""
        ...

    def move(self, base_from_flange: Float[np.ndarray, "4 4"]) -> bool:
        """Give the next setpoint, a fraction of a millimetre to some millimetres away, and return
        after one period; False where the arm has stopped by itself.
        """
        ...

    def wrench(self) -> Float[np.ndarray, " 6"]:
        """Force [N] and moment [N m] that the world exerts on the flange, about its origin, in its
        axes, as the sensor gives them: bias and the gripper's weight are taken off elsewhere.
        """
        ...

    def vacuum(self, on: bool) -> None:
        """Switch the vacuum; off also vents the pad."""
        ...

    def vacuum_pa(self) -> float:
        """Pressure at the pad under that of the air [Pa]; NaN where there is no sensor."""
        ...

    def wrist_depth_m(self) -> Float[np.ndarray, "h w"] | None:
        """Rectified depth picture of the wrist's camera [m], 0 where nothing was measured, taken
        while the arm stood or with the arm's pose of that moment; None where it has stopped.
        """
        ...

    def static_depths_m(self) -> list[Float[np.ndarray, "_ _"]] | None:
        """The same of every camera beside the table, in the order of their calibration."""
        ...

    def time_s(self) -> float:
        """The driver's clock [s]."""
        ...
