"""The soft pad as the referee finds it on a surface: its shape, the vacuum under it, the gap."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
from jaxtyping import Float

from pipeline.artifacts.tensors import from_tensor
from pipeline.config import RunConfig
from pipeline.geometry.mesh import Mesh
from pipeline.recording import colours
from pipeline.referee.disc import Disc
from pipeline.referee.seal import Seal
from pipeline.simulation.judges import RefereeBearing, RefereeJudge
from pipeline.world.posed_bodies import PosedBodies
from schemas.softgrip.v1.evaluation_pb2 import Attempt

LIFT_M = 3e-4  # the pad is drawn so far above what it lies on, as that is drawn simplified
MOST_GAP_MM = 5.0  # a wider gap is open, however wide


@dataclass(frozen=True, eq=False)
class SealedPad:
    """The pad at the last seal of an attempt.

    Attributes
    ----------
    step
        Number of the sample at which the vacuum was switched on.
    seal
        The referee's seal of the body that it holds best, in GCS.
    """

    step: int
    seal: Seal


def sealed_pad(
    made: Attempt, names: Sequence[str], meshes: Mapping[str, Mesh], config: RunConfig
) -> SealedPad | None:
    """The seal that the referee judged, found again from what the attempt tells.

    Parameters
    ----------
    made
        The attempt.
    names
        Names of its scene's objects, in the order of their body ids.
    meshes
        Mesh of each object by its name.
    config
        Sections referee, gripper, grasps and scenes of the run.

    Returns
    -------
    The pad; None where another judge judged, or nothing was sealed.
    """
    if made.judge != "referee" or not made.target_body:
        return None
    reached, path = from_tensor(made.reached_pose), from_tensor(made.gripper_path)
    away = np.abs(path - reached).max(axis=(1, 2))
    step = int(np.flatnonzero(away == away.min())[-1])
    poses = from_tensor(made.object_paths)[step]
    there = {i + 1: pose for i, pose in enumerate(poses) if np.isfinite(pose).all()}
    bodies = {i + 1: meshes[name] for i, name in enumerate(names)}
    surfaces = PosedBodies(bodies, config.scenes.table_side_m).at(there)
    found = RefereeJudge(config).find_seal(reached, surfaces)
    if found is None or not isinstance(found[1], RefereeBearing):
        return None
    return SealedPad(step, found[1].seal)


def show_pad(stream: rr.RecordingStream, path: str, seal: Seal, disc: Disc, full_pa: float) -> None:
    """Log the pad's face, coloured by the vacuum under it (dark 0, yellow a closed fan's).

    Parameters
    ----------
    stream
        The recording, already at its step.
    path
        Entity, in GCS.
    seal
        The referee's seal.
    disc
        The pad's elements.
    full_pa
        Vacuum of a closed fan [Pa].
    """
    stream.log(
        path,
        rr.Mesh3D(
            vertex_positions=np.column_stack([disc.vertices_xy_m, seal.pressed.face_m + LIFT_M]),
            triangle_indices=disc.triangles,
            vertex_colors=colours.by_value(seal.vacuum.under_face_pa / full_pa),
        ),
    )


def show_rings(stream: rr.RecordingStream, seal: Seal, disc: Disc) -> None:
    """Log by ring, centre to rim, the vacuum under the pad [Pa] and its gap [mm]."""
    for name, values in rings(seal, disc).items():
        stream.log(f"curves/{name}", rr.BarChart(values))


def rings(seal: Seal, disc: Disc) -> dict[str, Float[np.ndarray, " rings"]]:
    """Means by ring of the pad, centre to rim: the vacuum [Pa] and the gap, at most 5 [mm]."""
    away = np.linalg.norm(disc.vertices_xy_m, axis=1)
    _, ring = np.unique(np.round(away / disc.radius_m, 6), return_inverse=True)
    counts = np.bincount(ring)
    gap_mm = np.minimum(seal.film_m * 1e3, MOST_GAP_MM)
    return {
        "vacuum": np.bincount(ring, seal.vacuum.under_face_pa) / counts,
        "gap": np.bincount(ring, gap_mm) / counts,
    }
