"""The largest load that contact pressure and friction balance while the vacuum pulls.

The object is at rest where the vacuum's wrench, contact and load sum to zero. Contact pushes along
the surface, never pulls, and rubs within Coulomb's cone; how it spreads over the patches that touch
is free: the load is borne if any spread balances it (the static theorem of limit analysis). All
pushes together are no more than the vacuum's pull along the normals, for nothing else presses the
pad on; without that bound a pad between steep walls would jam there and bear any weight. Cones
are replaced by pyramids inside them, so this is a linear program in the multipliers of a few
hundred wrenches, by SciPy's HiGHS, and one load is checked by non-negative least squares.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import linprog, nnls

from pipeline.referee.disc import Disc

FRICTION_SIDES = 12  # of the pyramid in Coulomb's cone: 3.4 % less at most
BALANCED = 1e-6  # of the largest force in play
OPTIMAL, INFEASIBLE, UNBOUNDED = 0, 2, 3  # what linprog says
MOST, HALVINGS = 1e6, 40  # a scale over this is without end; a millionth of a millionth of it


class Balancing:
    """Finds pushes ≥ 0 that balance one load after another.

    The few columns that balanced the last load are tried first: while an object is carried, its
    load changes little from step to step, and the same columns balance it.
    """

    def __init__(self, columns: Float[np.ndarray, "r m"]) -> None:
        """Store the wrenches of unit pushes, a column each, shape (r, m)."""
        self._columns = columns
        self._last: tuple[Float[np.ndarray, "r k"], Float[np.ndarray, "k r"]] | None = None

    def balances(self, wanted: Float[np.ndarray, " r"], within: float) -> bool:
        """Whether some pushes sum up to a wrench.

        Parameters
        ----------
        wanted
            What the columns must sum up to, shape (r,).
        within
            How far the sum may stay off it, as a norm.

        Returns
        -------
        True where they do; the last columns alone never say no.
        """
        if self._last is not None:
            columns, inverse = self._last
            pushes = inverse @ wanted
            if pushes.min() >= 0.0 and np.linalg.norm(columns @ pushes - wanted) <= within:
                return True
        if not self._columns.shape[1]:  # SciPy's nnls ends the process on such a matrix
            return bool(np.linalg.norm(wanted) <= within)
        pushes, residual = nnls(self._columns, wanted)
        used = np.flatnonzero(pushes)
        if residual <= within and len(used):
            columns = self._columns[:, used]
            self._last = columns, np.linalg.pinv(columns)
        return bool(residual <= within)


@dataclass(frozen=True, eq=False)
class Hold:
    """What the pad can do to the object, as wrenches about the pad's origin in GCS.

    Attributes
    ----------
    suction
        Force [N] and moment [N m] of the vacuum on the object, shape (6,).
    contact
        Wrenches of contact, a column each of a unit push with its friction, shape (6, m).
    radius_m
        r_G, by which moments are made comparable with forces [m].
    most_n
        Contact pushes with no more than this in all, beside what the load itself presses on [N].
    """

    suction: Float[np.ndarray, " 6"]
    contact: Float[np.ndarray, "6 m"]
    radius_m: float
    most_n: float = np.inf

    def bears(self, load: Float[np.ndarray, " 6"]) -> bool:
        """Whether a load is balanced.

        Parameters
        ----------
        load
            Force [N] and moment [N m] that the object exerts on the pad about its origin, in GCS,
            shape (6,): its weight and inertia. A pull away from the pad is along -z.

        Returns
        -------
        True where contact and friction can balance it.
        """
        wanted = self._scaled(-(load + self.suction))
        if np.isfinite(self.most_n):  # pushes and what is left of them make up the most
            wanted = np.append(wanted, self.most_n + max(float(load[2]), 0.0))
        largest = max(self._largest_suction, float(np.abs(wanted).max()))
        return self._balancing.balances(wanted, BALANCED * largest)

    def largest_scale(self, load: Float[np.ndarray, " 6"]) -> float:
        """The largest t for which t times the load is borne.

        Parameters
        ----------
        load
            As in `bears`, shape (6,).

        Returns
        -------
        t ≥ 0; 0 where nothing is held at all, inf where the load presses on for ever.
        """
        columns = np.column_stack([self._scaled(self.contact), self._scaled(load)])
        cost = np.zeros(columns.shape[1])
        cost[-1] = -1.0
        pushes, most = None, None
        if np.isfinite(self.most_n):
            pushes = np.append(np.ones(self.contact.shape[1]), -max(float(load[2]), 0.0))[None]
            most = np.array([self.most_n])
        found = linprog(cost, pushes, most, columns, self._scaled(-self.suction), method="highs")
        if found.status == INFEASIBLE:
            return 0.0
        if found.status == UNBOUNDED:
            return np.inf
        return float(found.x[-1]) if found.status == OPTIMAL else self._scale_by_halving(load)

    def largest_common_scale(self, loads: Float[np.ndarray, "n 6"]) -> float:
        """The largest t for which t times each of several loads is borne by itself.

        What is borne is convex: a load that is borne at the least t so far needs no program.

        Parameters
        ----------
        loads
            As in `bears`, a load a row, shape (n, 6).

        Returns
        -------
        The least of their `largest_scale`.
        """
        least = np.inf
        for load in loads:
            if not (np.isfinite(least) and self.bears(least * load)):
                least = min(least, self.largest_scale(load))
        return float(least)

    @cached_property
    def _balancing(self) -> Balancing:
        columns = self._scaled(self.contact)
        if np.isfinite(self.most_n):
            left = np.append(np.ones(columns.shape[1]), 1.0)
            columns = np.vstack([np.column_stack([columns, np.zeros(6)]), left])
        return Balancing(columns)

    @cached_property
    def _largest_suction(self) -> float:
        return float(np.abs(self._scaled(self.suction)).max())

    def _scale_by_halving(self, load: Float[np.ndarray, " 6"]) -> float:
        """The same by checking loads, where the linear program meets numerical difficulties."""
        if not self.bears(np.zeros(6)):
            return 0.0
        low, high = 0.0, 1.0
        while self.bears(high * load):
            low, high = high, 2.0 * high
            if high > MOST:
                return np.inf
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.bears(middle * load) else (low, middle)
        return low

    def _scaled(self, wrenches: Float[np.ndarray, "6 *more"]) -> Float[np.ndarray, "6 *more"]:
        """With moments over r_G."""
        unit = np.array([1.0, 1.0, 1.0, *(3 * [1.0 / self.radius_m])])
        return np.asarray((wrenches.T * unit).T)


def suction_wrench(
    disc: Disc,
    vacuum_pa: Float[np.ndarray, " n"],
    surface_m: Float[np.ndarray, " n"],
    on_target: Bool[np.ndarray, " n"],
) -> Float[np.ndarray, " 6"]:
    """The vacuum's wrench on the object: p (-∂s/∂x, -∂s/∂y, 1) over the elements' area.

    Gradients are those of the elements, so that the walls of a pit under an even vacuum cancel.

    Parameters
    ----------
    disc
        The pad's elements.
    vacuum_pa
        p under the face, shape (n,) [Pa].
    surface_m
        Height of the surface, shape (n,), GCS [m].
    on_target
        Whether it is the object's, shape (n,).

    Returns
    -------
    Force [N] and moment [N m] about the pad's origin, shape (6,).
    """
    x, y = disc.vertices_xy_m.T
    pulls = np.where(on_target, vacuum_pa * disc.areas_m2, 0.0)
    wrench = np.array([0.0, 0.0, pulls.sum(), y @ pulls, -(x @ pulls), 0.0])
    inside, slope_x, slope_y = _slopes(disc, surface_m, on_target)
    corners = disc.triangles[inside]
    cx, cy = x[corners], y[corners]
    push = vacuum_pa[corners].mean(axis=1) * disc.triangle_areas_m2[inside]
    fx, fy = -push * slope_x, -push * slope_y
    z = surface_m[corners].mean(axis=1)
    wrench[0] += fx.sum()
    wrench[1] += fy.sum()
    wrench[3] -= z @ fy
    wrench[4] += z @ fx
    wrench[5] += cx.mean(axis=1) @ fy - cy.mean(axis=1) @ fx
    return wrench


def suction_along_normals_n(
    disc: Disc,
    vacuum_pa: Float[np.ndarray, " n"],
    surface_m: Float[np.ndarray, " n"],
    on_target: Bool[np.ndarray, " n"],
) -> float:
    """The vacuum's pull on the object with all directions counted alike [N].

    Parameters
    ----------
    disc
        The pad's elements.
    vacuum_pa
        p under the face, shape (n,) [Pa].
    surface_m
        Height of the surface, shape (n,), GCS [m].
    on_target
        Whether it is the object's, shape (n,).

    Returns
    -------
    ∫ p √(1 + |∇s|²) dA, gradients those of the elements.
    """
    corners, slope_x, slope_y = _slopes(disc, surface_m, on_target)
    push = vacuum_pa[disc.triangles[corners]].mean(axis=1) * disc.triangle_areas_m2[corners]
    level = float(np.where(on_target, vacuum_pa * disc.areas_m2, 0.0).sum())
    return level + float(push @ (np.sqrt(1.0 + slope_x**2 + slope_y**2) - 1.0))


def _slopes(
    disc: Disc, surface_m: Float[np.ndarray, " n"], on_target: Bool[np.ndarray, " n"]
) -> tuple[Bool[np.ndarray, " m"], Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """Elements that lie on the object whole, and ∂s/∂x and ∂s/∂y of these."""
    x, y = disc.vertices_xy_m.T
    inside = on_target[disc.triangles].all(axis=1)
    corners = disc.triangles[inside]
    twice = 2 * disc.triangle_areas_m2[inside]
    height = surface_m[corners]
    slope_x, slope_y = (
        sum(height[:, k] * (c[:, (k + 1) % 3] - c[:, (k + 2) % 3]) for k in range(3)) / twice
        for c in (y[corners], -x[corners])
    )
    return inside, np.asarray(slope_x), np.asarray(slope_y)


def contact_wrenches(
    disc: Disc,
    touches: Bool[np.ndarray, " n"],
    surface_m: Float[np.ndarray, " n"],
    normals: Float[np.ndarray, "n 3"],
    friction: float,
) -> Float[np.ndarray, "6 m"]:
    """Wrenches of a unit push on each patch that touches, with friction to every side.

    Parameters
    ----------
    disc
        The pad's elements and patches.
    touches
        Vertices in contact with the object, shape (n,).
    surface_m
        Height of the surface, shape (n,), GCS [m].
    normals
        Unit normals of the surface, shape (n, 3), GCS.
    friction
        μ [1].

    Returns
    -------
    A column for each patch and side, shape (6, patches * FRICTION_SIDES).
    """
    area = np.where(touches, disc.areas_m2, 0.0)
    points = np.column_stack([disc.vertices_xy_m, np.where(touches, surface_m, 0.0)])
    total = np.bincount(disc.patch, area)
    used = total > 0.0

    def of_patches(values: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "patches 3"]:
        sums = [np.bincount(disc.patch, area * values[:, axis]) for axis in range(3)]
        return np.asarray(np.column_stack(sums)[used])

    centres = of_patches(points) / total[used, None]
    mean = of_patches(normals)
    mean /= np.linalg.norm(mean, axis=1, keepdims=True)
    # Two tangents that turn and mirror with the normal: along the steepest descent, and across.
    steep = mean[:, :2] / np.maximum(np.linalg.norm(mean[:, :2], axis=1, keepdims=True), 1e-9)
    level = np.linalg.norm(mean[:, :2], axis=1) < 1e-9
    steep[level] = (1.0, 0.0)
    across = np.column_stack([-steep[:, 1], steep[:, 0], np.zeros(len(steep))])
    along = np.cross(across, mean)
    angle = 2 * np.pi * np.arange(FRICTION_SIDES) / FRICTION_SIDES
    rubs = (
        np.cos(angle)[None, :, None] * along[:, None]
        + np.sin(angle)[None, :, None] * (across[:, None])
    )
    forces = (-mean[:, None] + friction * rubs).reshape(-1, 3)
    moments = np.cross(np.repeat(centres, FRICTION_SIDES, axis=0), forces)
    return np.concatenate([forces.T, moments.T])


def weight_loads(
    gripper_from_world: Float[np.ndarray, "4 4"],
    centre_of_mass_m: Float[np.ndarray, " 3"],
    up_m_s2: float,
    side_m_s2: float,
) -> Float[np.ndarray, "4 6"]:
    """Loads of one kilogram that is lifted while the gripper moves to one of four sides.

    Parameters
    ----------
    gripper_from_world
        Shape (4, 4); gravity is along -z of the world.
    centre_of_mass_m
        Of the object, shape (3,), in the world [m].
    up_m_s2
        Acceleration upwards, gravity among it [m/s2].
    side_m_s2
        Acceleration sidewards [m/s2].

    Returns
    -------
    A load a row about the pad's origin in GCS, shape (4, 6) [N/kg, N m/kg].
    """
    rotation, origin = gripper_from_world[:3, :3], gripper_from_world[:3, 3]
    centre = rotation @ centre_of_mass_m + origin
    loads = []
    for x, y in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)):
        force = rotation @ np.array([-side_m_s2 * x, -side_m_s2 * y, -up_m_s2])
        loads.append(np.concatenate([force, np.cross(centre, force)]))
    return np.array(loads)
