"""Seals of a report: the pad as the referee sees it, where it held and where it did not.

A row each: the pad's face over the surface in a cut, the gap, the vacuum under the face with the
vertices that touch, and what hung on the pad beside what it bears.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.collections import TriMesh
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from pipeline.artifacts import open_artifact
from pipeline.artifacts.tensors import from_tensor
from pipeline.config import RunConfig
from pipeline.control.decision import Cause
from pipeline.execution import RunFolder
from pipeline.messages.objects import read_objects
from pipeline.recording.colours import PALETTE
from pipeline.recording.pads import MOST_GAP_MM, SealedPad, sealed_pad
from pipeline.referee.disc import Disc
from pipeline.referee.seal import referee_of
from pipeline.reporting.plots import STYLE, WIDTH_IN, rgb, svg_text
from pipeline.spread import choose_evenly
from schemas.softgrip.v1.evaluation_pb2 import Attempt
from schemas.softgrip.v1.scenes_pb2 import Scene

LOST = (Cause.NO_SEAL, Cause.LOST_IN_LIFT, Cause.LOST_IN_SHAKE, Cause.LOST_IN_TRANSPORT)
ROW_IN = 1.5  # height of a row: the maps are round at this width of page
ON_AXIS_RG = 1e-6  # vertices of the cut lie on the axis to rounding


@dataclass(frozen=True)
class ShownSeal:
    """An attempt, and the pad at its last seal."""

    made: Attempt
    pad: SealedPad


def seals_of(folder: RunFolder, config: RunConfig, policy: str, each: int) -> list[ShownSeal]:
    """Some seals of a policy that held and some that did not, from a finished evaluation.

    Parameters
    ----------
    folder
        The run.
    config
        Its configuration.
    policy
        Whose attempts.
    each
        At most so many of either kind.

    Returns
    -------
    The lost ones first, each kind by what it bears over what it should; none where the referee did
    not judge.
    """
    with open_artifact(folder.artifact("evaluate")) as artifact:
        attempts = [m for _, m in artifact.messages(Attempt) if m.policy == policy]
    chosen = kept_and_lost(attempts, each)
    if not chosen:
        return []
    meshes = {n: item.mesh for n, (item, _) in read_objects(folder.artifact("objects")).items()}
    with open_artifact(folder.artifact("scenes")) as artifact:
        names = {
            scene.scene_id: [placed.object_name for placed in scene.objects]
            for _, scene in artifact.messages(Scene)
        }
    pads = [(made, sealed_pad(made, names[made.scene_id], meshes, config)) for made in chosen]
    return [ShownSeal(made, pad) for made, pad in pads if pad is not None]


def kept_and_lost(attempts: Sequence[Attempt], each: int) -> list[Attempt]:
    """Attempts at equal distances from the weakest to the strongest seal, the lost ones first.

    Parameters
    ----------
    attempts
        All of one policy's.
    each
        At most so many of those that lost the object, and of those that lifted it.

    Returns
    -------
    The chosen, each kind by what the last seal bears over the object's weight.
    """
    sealed = [m for m in attempts if m.judge == "referee" and m.target_body and m.weight_n > 0.0]
    kinds = (
        [made for made in sealed if made.cause in LOST],
        [made for made in sealed if made.outcome == "lifted"],
    )
    chosen = []
    for kind in kinds:
        ordered = sorted(kind, key=lambda m: (m.borne_n / m.weight_n, m.scene_id, m.attempt))
        chosen += [ordered[i] for i in choose_evenly(len(ordered), each)]
    return chosen


def seals_figure(shown: Sequence[ShownSeal], config: RunConfig) -> str:
    """The seals as SVG, a row each.

    Parameters
    ----------
    shown
        At least one.
    config
        Sections referee and gripper of the run.

    Returns
    -------
    The figure, the same for the same seals.
    """
    referee = referee_of(config.referee, config.gripper.pad.radius_m)
    full_kpa = referee.fan.vacuum_pa / 1e3
    with mpl.rc_context(STYLE | {"axes.grid": False, "font.size": 7}):
        figure = Figure(figsize=(WIDTH_IN, ROW_IN * len(shown) + 0.3), layout="constrained")
        grid = figure.subplots(len(shown), 4, squeeze=False, width_ratios=[1.5, 1, 1, 1.5])
        for row, (cut, gap, vacuum, load) in enumerate(grid):
            made, seal = shown[row].made, shown[row].pad.seal
            verdict = "lifted" if made.outcome == "lifted" else made.cause
            _cut(cut, shown[row].pad, referee.disc)
            cut.set_title(f"{made.target}: {verdict}", loc="left")
            gap_mm = np.clip(seal.film_m * 1e3, None, MOST_GAP_MM)
            norm = LogNorm(config.referee.roughness_m * 1e3, MOST_GAP_MM)
            gaps = _map(gap, referee.disc, gap_mm, cmap="cividis_r", norm=norm)
            under = seal.vacuum.under_face_pa / 1e3
            field = _map(vacuum, referee.disc, under, cmap="viridis", vmin=0.0, vmax=full_kpa)
            x_mm, y_mm = 1e3 * referee.disc.vertices_xy_m[seal.touches].T
            vacuum.plot(x_mm, y_mm, ".", ms=0.8, color="w")
            _load(load, shown[row])
            figure.colorbar(gaps, ax=gap, shrink=0.8)
            figure.colorbar(field, ax=vacuum, shrink=0.8)
        grid[0, 1].set_title("gap [mm]")
        grid[0, 2].set_title("vacuum [kPa]")
        grid[-1, 0].set_xlabel("x of the pad [mm]")
        grid[-1, 3].set_xlabel("since the seal [s]")
        for axes in (grid[0, 0], grid[0, 3]):
            axes.legend(fontsize=6)
        return svg_text(figure)


def _cut(axes: Axes, pad: SealedPad, disc: Disc) -> None:
    """Face and surface along the pad's x axis."""
    on_axis = np.abs(disc.vertices_xy_m[:, 1]) <= ON_AXIS_RG * disc.radius_m
    order = np.flatnonzero(on_axis)[np.argsort(disc.vertices_xy_m[on_axis, 0])]
    x_mm, height_m = 1e3 * disc.vertices_xy_m[order, 0], pad.seal.surface.height_m[order]
    there = np.where(np.isfinite(height_m), height_m, np.nan)
    axes.plot(x_mm, 1e3 * there, "-", color="0.4", lw=1.5, label="surface")
    axes.plot(x_mm, 1e3 * pad.seal.pressed.face_m[order], "--", color=rgb(PALETTE[0]), label="pad")
    axes.set_ylabel("z [mm]")


def _map(axes: Axes, disc: Disc, values: Float[np.ndarray, " n"], **style: Any) -> TriMesh:
    """Values at the pad's vertices, seen from the gripper; as pixels, for a small page."""
    axes.set_aspect("equal")
    axes.set_axis_off()
    x_mm, y_mm = 1e3 * disc.vertices_xy_m.T
    drawn: TriMesh = axes.tripcolor(
        x_mm, y_mm, disc.triangles, values, shading="gouraud", rasterized=True, **style
    )
    return drawn


def _load(axes: Axes, one: ShownSeal) -> None:
    """What hangs on the pad after the seal, beside the weight that it bears."""
    made, since = one.made, one.pad.step + 1  # the step of the seal still pushes
    poses, wrench = from_tensor(made.gripper_path), from_tensor(made.base_wrench)
    hangs_n = -np.einsum("tj,tj->t", poses[since:, 2, :3], wrench[since:, :3])
    time_s = from_tensor(made.time_s)
    axes.plot(
        time_s[since:] - time_s[one.pad.step], hangs_n, color=rgb(PALETTE[4]), lw=0.8, label="hangs"
    )
    axes.axhline(made.borne_n, color=rgb(PALETTE[5]), ls="--", lw=0.8, label="bears")
    axes.axhline(made.weight_n, color="0.5", ls=":", lw=0.8, label="weighs")
    axes.set_ylabel("[N]")
