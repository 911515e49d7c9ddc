"""The wrench that each contact triangle can exert: Eq. (1), (3)-(7), S-1.09, S-1.10.

Assumption A-3 acts here: of the six components of a wrench the supplement keeps
F_x, F_y, F_z and T_z; the object's weight and the torques about x and y are left out.
Eq. (1) makes the axes n_x, n_y, n_z of every force those of GCS, so a scalar stands
for each force along its axis.
"""

import numpy as np
from jaxtyping import Float

from pipeline.gripper.contact import Contact
from pipeline.gripper.pad import Pad


def wrench_matrix(pad: Pad, contact: Contact, friction: float) -> Float[np.ndarray, "4 n"]:
    """G of S-1.10: rows f_x, f_y, f_z, tau_z of Eq. (3)-(6), one column a contact triangle.

    Dimensionless: forces are divided by A^G, the torque by A^G r_G, and p by one
    atmosphere of difference, so that a flat pad in full contact has G 1 = (0, 0, 1, 0).

    Parameters
    ----------
    pad
        The pad in GCS.
    contact
        Its n contact triangles and the pressure p.
    friction
        Mu of Eq. (3) and (4) [1].

    Returns
    -------
    G, shape (4, n).
    """
    pull = contact.pressure * contact.areas_m2 / pad.area_m2
    n_x, n_y, n_z = contact.normals.T
    f_x = pull * n_x + friction * pull * n_x  # Eq. (3)
    f_y = pull * n_y + friction * pull * n_y  # Eq. (4)
    f_z = pull * n_z  # Eq. (5)
    c_x, c_y, _ = contact.centres_m.T / pad.radius_m
    tau_z = c_x * f_y - c_y * f_x  # Eq. (6)
    return np.stack([f_x, f_y, f_z, tau_z])


def vacuum_force(pad: Pad, contact: Contact) -> float:
    """F_v of Eq. (7) over p A^G: p times the deformed area in contact [1]."""
    return float(contact.pressure * contact.areas_m2.sum() / pad.area_m2)
