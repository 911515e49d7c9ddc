"""A cushion under a skin, pressed on a surface: an obstacle problem.

The pad's face z is a skin of tension T [N/m] on a cushion of stiffness k [Pa/m] whose back is at
rest height z_0. It minimises ½ ∫ T |∇z|² + k (z - z_0)² + F z_0 over z ≥ s, the surface under it:
a variational inequality. Its multiplier is the contact pressure, and the minimum over z_0 says that
contact carries the force F. The cushion is granulate that flows: it has no shear stiffness.
Bending of the skin is left out: its length (D/k)^¼ is well under √(T/k).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy import sparse
from scipy.sparse.linalg import splu

from pipeline.referee.disc import Disc, laplacian

MOST_STEPS = 100  # an M-matrix needs about a dozen; so many would be a mistake


@dataclass(frozen=True, eq=False)
class Pressed:
    """The pad at rest on the surface.

    Attributes
    ----------
    face_m
        z, height of the pad's face at each vertex, GCS, shape (n,) [m].
    back_m
        z_0, where the face would be without contact [m].
    contact_n
        Force of contact that each vertex stands for, ≥ 0, shape (n,) [N].
    """

    face_m: Float[np.ndarray, " n"]
    back_m: float
    contact_n: Float[np.ndarray, " n"]

    @property
    def touches(self) -> Bool[np.ndarray, " n"]:
        """Vertices that the surface pushes."""
        return self.contact_n > 0.0


@dataclass(frozen=True)
class Cushion:
    """k, stiffness of the cushion [Pa/m], and T, tension of the skin [N/m]."""

    stiffness_pa_m: float
    tension_n_m: float


def press(
    disc: Disc, cushion: Cushion, surface_m: Float[np.ndarray, " n"], force_n: float
) -> Pressed:
    """The pad pressed on a surface, by primal-dual active sets; the plain way, and the oracle.

    Parameters
    ----------
    disc
        The pad's elements.
    cushion
        Its stiffness and tension.
    surface_m
        s, height of the surface under each vertex, shape (n,), GCS; -inf where there is none [m].
    force_n
        F > 0, with which the pad is pressed along -z [N].

    Returns
    -------
    The pad at rest on the surface.

    Raises
    ------
    ValueError
        There is no surface at all.
    """
    if not np.isfinite(surface_m).any():
        raise ValueError("a pad cannot be pressed where there is no surface")
    skin = cushion.tension_n_m * laplacian(disc, disc.weights)
    springs = cushion.stiffness_pa_m * disc.areas_m2
    active = surface_m >= surface_m.max()
    for _ in range(MOST_STEPS):
        face, back = _with_contact(skin, springs, surface_m, active, force_n)
        pushes = skin @ face + springs * (face - back)
        # A vertex stays while it is pushed, and joins where the face went through the surface.
        found = np.where(active, pushes > 0.0, face < surface_m)
        if (found == active).all():
            return Pressed(face, back, np.where(active, pushes, 0.0))
        active = found
    raise RuntimeError(f"active sets did not settle in {MOST_STEPS} steps")


def _with_contact(
    skin: sparse.csr_array,
    springs: Float[np.ndarray, " n"],
    surface_m: Float[np.ndarray, " n"],
    active: Bool[np.ndarray, " n"],
    force_n: float,
) -> tuple[Float[np.ndarray, " n"], float]:
    """Face and rest height, where exactly the active vertices lie on the surface."""
    free = ~active
    held = surface_m[active]
    face = np.empty(len(springs))
    face[active] = held
    if not free.any():
        return face, float((springs @ face - force_n) / springs.sum())
    rows = skin[free]
    matrix = sparse.csc_array(rows[:, free] + sparse.diags_array(springs[free]))
    solve = splu(matrix).solve
    fixed, by_back = solve(-(rows[:, active] @ held)), solve(springs[free])
    # z = fixed + z_0 by_back; the springs together carry F.
    carried = springs[free] @ fixed + springs[active] @ held
    back = (carried - force_n) / (springs.sum() - springs[free] @ by_back)
    face[free] = fixed + back * by_back
    return face, float(back)
