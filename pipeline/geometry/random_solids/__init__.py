"""Solids without end, from a seed: training shapes that no folder has and nobody drew."""

from collections.abc import Sequence

import numpy as np

from pipeline.errors import MeshError
from pipeline.geometry.manifolds import from_manifold
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.parametric.solids import Solid
from pipeline.geometry.random_solids import bodies, fine_structure, household, relief
from pipeline.geometry.random_solids.grain import grained
from pipeline.geometry.random_solids.skins import bent_and_rough, mark
from pipeline.geometry.shape import mean_thickness

# Edges are split so that the shortest waves of a skin show: 8 mm.
_EDGE_M = 0.004
# Those of scans are some 2 mm long; a body of many faces keeps longer ones, and a coarser grain.
_GRAINED_EDGES_M = (0.0022, 0.003, _EDGE_M)
_MARKED_SHARE = 0.45
_LEAST_THICKNESS = 0.01  # 2 V / A over the longest extent: a cup with a wall of 1 mm
_MOST_FACES = 40_000  # a scan has 16 000; more is fine ribs that no camera sees
_MOST_DRAWS = 50
KINDS = {**bodies.KINDS, **household.KINDS, **relief.KINDS, **fine_structure.KINDS}


def random_solid(rng: np.random.Generator, kinds: Sequence[str], grained_share: float) -> Mesh:
    """A closed mesh of one body, some 0.1 m long; the same for the same stream.

    Parameters
    ----------
    rng
        Draws everything: the kind of body, its marks, its skin.
    kinds
        Kinds of bodies to draw from, of `KINDS`.
    grained_share
        Share of them that have a grain on their skin, see ``grain`` [1].

    Returns
    -------
    The mesh [m].

    Raises
    ------
    MeshError
        None of 50 draws is a body of some thickness: the stream is no random one.
    """
    shares = np.array([KINDS[kind][1] for kind in kinds])
    for _ in range(_MOST_DRAWS):
        kind = kinds[rng.choice(len(kinds), p=shares / shares.sum())]
        body = KINDS[kind][0](rng)
        # The others have their detail: a dish full of dents would be a sieve.
        if kind in bodies.KINDS and rng.random() < _MARKED_SHARE:
            body = mark(body, rng)
        mesh = _surface(body, rng, grained_share)
        if mesh is not None:
            return mesh
    raise MeshError("No random solid came out", "Draw it with another seed")


def _surface(body: Solid, rng: np.random.Generator, grained_share: float) -> Mesh | None:
    """The largest piece, its edges split and its skin warped; None for a sheet or a sieve."""
    pieces = body.decompose()
    if not pieces:
        return None
    largest = max(pieces, key=lambda piece: piece.volume())
    longest = float(np.subtract(largest.bounding_box()[3:], largest.bounding_box()[:3]).max())
    if longest <= 0:
        return None
    # Without grains nothing is drawn: solids of runs before grains stay what they are.
    has_grain = grained_share > 0 and rng.random() < grained_share
    whole = largest.scale(tuple([0.12 / longest] * 3))
    for edge_m in _GRAINED_EDGES_M if has_grain else (_EDGE_M,):
        sized = whole.refine_to_length(edge_m)
        if sized.num_tri() <= _MOST_FACES:
            break
    else:
        return None
    mesh = from_manifold(sized)
    mesh = Mesh(bent_and_rough(np.array(mesh.vertices_m), rng), mesh.faces)
    if mean_thickness(mesh) < _LEAST_THICKNESS * float(mesh.extents_m.max()):
        return None
    return grained(mesh, rng) if has_grain else mesh
