"""Air under the pad: a thin film between face and surface, openings in the face, the atmosphere.

The vacuum p under the face obeys Reynolds' equation ∇·(h³/12μ ∇p) + v(P - p) = 0: the film of
height h lets air in from the rim, and from where the surface ends; openings all over the face draw
it off at the velocity v into the cushion, which the fan keeps at the vacuum P. Openings are
orifices behind a bed of grains, P - p = a v + b v² with b = ρ / (2 C_d² φ²) and, by Ergun's
equation, a = 150 μ (1 - ε)² L / (ε³ d²). Where the face touches, roughness leaves a film of its
own height.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy import sparse
from scipy.sparse.linalg import spsolve

from pipeline.referee.disc import Disc, laplacian
from pipeline.referee.pump import Fan, working_point

AIR_VISCOSITY_PA_S = 1.81e-5  # at 20 degrees
AIR_DENSITY_KG_M3 = 1.20  # at 20 degrees and one atmosphere
GRAIN_VOIDS = 0.4  # epsilon of grains that lie loosely
WIDEST_FILM_M = 3e-3  # in wider gaps the pressure is even all the same, and matrices worse
MOST_STEPS = 60  # bounds a film that does not settle
SETTLED = 1e-4  # of the fan's vacuum


@dataclass(frozen=True)
class Face:
    """a [Pa s/m] and b [Pa s2/m2] of P - p = a v + b v²."""

    viscous: float
    inertial: float

    @classmethod
    def of(cls, open_share: float, discharge: float, grain_m: float, bed_m: float) -> "Face":
        """Openings of a share φ of the face with C_d, behind a bed of grains.

        Parameters
        ----------
        open_share
            φ, share of the face that is openings [1].
        discharge
            C_d of the openings [1].
        grain_m
            d, diameter of the grains [m].
        bed_m
            L, thickness of the bed [m].

        Returns
        -------
        The face.
        """
        solid = 1.0 - GRAIN_VOIDS
        viscous = 150 * AIR_VISCOSITY_PA_S * solid**2 * bed_m / (GRAIN_VOIDS**3 * grain_m**2)
        return cls(viscous, AIR_DENSITY_KG_M3 / (2 * (discharge * open_share) ** 2))

    def permeance(self, drop_pa: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """v / (P - p) at a drop of pressure, shape (n,) [m/s/Pa]."""
        drop = np.maximum(drop_pa, 0.0)
        return np.asarray(
            2.0 / (self.viscous + np.sqrt(self.viscous**2 + 4 * self.inertial * drop))
        )


@dataclass(frozen=True, eq=False)
class Vacuum:
    """Air under the pad at the fan's working point.

    Attributes
    ----------
    under_face_pa
        p at each vertex, below the atmosphere, shape (n,) [Pa].
    in_cushion_pa
        P, what the fan keeps up [Pa].
    flow_m3_s
        Q that it draws for that [m3/s].
    """

    under_face_pa: Float[np.ndarray, " n"]
    in_cushion_pa: float
    flow_m3_s: float


def film_edges(
    disc: Disc, film_m: Float[np.ndarray, " n"], open_to_air: Bool[np.ndarray, " n"]
) -> Float[np.ndarray, " e"]:
    """The film's conductance along each edge: the mean of 12μ/h³ inverted, times its weight.

    Along an edge the film rises straight from one height to the other, so the mean of 1/h³ is
    (h₁ + h₂) / (2 h₁² h₂²). Where one end is open to the air, the body ends half way: what counts
    is half an edge of the other end's height.

    Parameters
    ----------
    disc
        The pad's elements.
    film_m
        h > 0 at each vertex, shape (n,) [m].
    open_to_air
        Vertices at the pressure of the atmosphere, shape (n,).

    Returns
    -------
    A conductance for each entry of ``disc.neighbours`` [m3/s/Pa].
    """
    film = np.minimum(film_m, WIDEST_FILM_M)
    owner = np.repeat(np.arange(len(film)), np.diff(disc.starts))
    here, there = film[owner], film[disc.neighbours]
    cubed = 2 * here**2 * there**2 / (here + there)
    cubed = np.where(open_to_air[disc.neighbours], 2 * here**3, cubed)
    cubed = np.where(open_to_air[owner], 2 * there**3, cubed)
    return np.asarray(disc.weights * cubed / (12 * AIR_VISCOSITY_PA_S))


def film_mobility(film_m: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """h³/12μ at each vertex [m3/s/Pa]."""
    return np.asarray(np.minimum(film_m, WIDEST_FILM_M) ** 3 / (12 * AIR_VISCOSITY_PA_S))


def film_shares(
    disc: Disc,
    film_m: Float[np.ndarray, " n"],
    open_to_air: Bool[np.ndarray, " n"],
    permeance: Float[np.ndarray, " n"],
) -> Float[np.ndarray, " n"]:
    """p / P for openings of a fixed permeance: Reynolds' equation, linear.

    Parameters
    ----------
    disc
        The pad's elements.
    film_m
        h > 0 at each vertex, shape (n,) [m].
    open_to_air
        Vertices at the pressure of the atmosphere, shape (n,).
    permeance
        v / (P - p) at each vertex, shape (n,) [m/s/Pa].

    Returns
    -------
    In [0, 1] at each vertex, shape (n,).
    """
    closed = ~open_to_air
    shares = np.zeros(len(film_m))
    if closed.any():
        drawn = disc.areas_m2 * permeance
        to_air = disc.rim_weights * film_mobility(film_m)
        matrix = laplacian(disc, film_edges(disc, film_m, open_to_air)) + sparse.diags_array(
            drawn + to_air
        )
        inner = sparse.csc_array(matrix[closed][:, closed])
        shares[closed] = spsolve(inner, drawn[closed])
    return shares


def leak(
    disc: Disc,
    film_m: Float[np.ndarray, " n"],
    open_to_air: Bool[np.ndarray, " n"],
    face: Face,
    fan: Fan,
) -> Vacuum:
    """The fan's working point against film and openings; the plain way, and the oracle.

    With the permeance of the last step, film and openings are linear and one solution gives all;
    repeated until the vacuum stays.

    Parameters
    ----------
    disc
        The pad's elements.
    film_m
        h > 0 at each vertex, shape (n,) [m].
    open_to_air
        Vertices at the pressure of the atmosphere, shape (n,).
    face
        Openings through which the air goes.
    fan
        What draws it.

    Returns
    -------
    The vacuum under the face, and the flow.
    """
    vacuum_pa = fan.vacuum_pa
    under_pa = np.zeros(len(film_m))
    for _ in range(MOST_STEPS):
        permeance = face.permeance(vacuum_pa - under_pa)
        shares = film_shares(disc, film_m, open_to_air, permeance)
        conductance = float((disc.areas_m2 * permeance) @ (1.0 - shares))
        before_pa = np.append(under_pa, vacuum_pa)
        vacuum_pa = working_point(fan, conductance)
        under_pa = vacuum_pa * shares
        if np.abs(np.append(under_pa, vacuum_pa) - before_pa).max() <= SETTLED * fan.vacuum_pa:
            break
    return Vacuum(under_pa, vacuum_pa, conductance * vacuum_pa)
