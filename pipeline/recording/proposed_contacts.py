"""Average precision and error analysis as tables, and the worst clouds of the worst objects."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr
from jaxtyping import Float

from pipeline.messages.proposed_contacts import WorstContact
from pipeline.recording import colours
from pipeline.recording.recording import SHEET_SPACING

WORST = "world/worst"
WORST_OBJECTS, WORST_EACH = 6, 3  # rows and pairs of columns: as many as can be looked at
SEEN = {"train": "seen families", "val": "unseen families, val", "test": "unseen families"}


def precision_markdown(by_split: Mapping[str, Mapping[str, Mapping[str, float]]]) -> str:
    """Average precision of every ranking in every split, as evaluate's summary has it."""
    first = next(iter(next(iter(by_split.values())).values()))
    names = [name for name in first if name.startswith("AP")]
    rows = "\n".join(
        f"| {SEEN[split]} | {ranking} | "
        + " | ".join(f"{found[name]:.3f}" for name in names)
        + f" | {found['scenes']} | {found['judged']:.0f} |"
        for split, by_ranking in by_split.items()
        for ranking, found in by_ranking.items()
    )
    return (
        "### Ranked contacts\n\nAverage precision over the best contacts of a clutter, good from "
        "q = s on, at most 50 and 2 cm apart by default (as SuctionNet-1Billion defines; best and "
        "any order are ceiling and floor).\n\n"
        f"| clutters of | ranked by | {' | '.join(names)} | clutters | judged |\n"
        f"|-|-|{'-|' * len(names)}-|-|\n{rows}\n"
    )


def errors_markdown(analysis: Mapping[str, Any]) -> str:
    """Mean |q-hat - q| over the same contacts, group by group."""
    names = list(analysis["all"]["errors"])
    rows = [_row("all", analysis["all"])]
    for title, key in (
        ("", "by_class"),
        ("tilt ", "by_tilt"),
        ("edge at ", "by_edge"),
        ("", "by_object"),
    ):
        rows += [_row(f"{title}{name}", group) for name, group in analysis[key].items()]
    return (
        "### Where predictions err\n\nMean &#124;q-hat - q&#124; over contacts that a policy would "
        "propose in clutters of unseen families, one prediction each; beside the network itself on "
        "the same contacts seen without the sensors' noise; objects by falling error.\n\n"
        f"| contacts | number | mean q | {' | '.join(names)} |\n"
        f"|-|-|-|{'-|' * len(names)}\n" + "\n".join(rows) + "\n"
    )


def show_worst(
    stream: rr.RecordingStream, worst: Mapping[str, Sequence[WorstContact]], ordered: Sequence[str]
) -> None:
    """Log the worst clouds of the worst objects: each as measured, and right of it without noise.

    Parameters
    ----------
    stream
        The recording.
    worst
        Object → its worst contacts.
    ordered
        Objects, the one with the largest error first; a row each.
    """
    for row, name in enumerate([name for name in ordered if name in worst][:WORST_OBJECTS]):
        for number, one in enumerate(worst[name][:WORST_EACH]):
            _show(
                stream, (row, 2 * number), one.cloud, one.predicted, f"{name}: q {one.quality:.2f}"
            )
            _show(
                stream,
                (row, 2 * number + 1),
                one.cloud_without_noise,
                one.predicted_without_noise,
                "without noise",
            )


def _show(
    stream: rr.RecordingStream,
    cell: tuple[int, int],
    cloud: Float[np.ndarray, "g g 3"],
    predicted: float,
    words: str,
) -> None:
    row, column = cell
    shift = SHEET_SPACING * np.array([column, -row, 0.0])
    points = cloud[np.isfinite(cloud[..., 2])] + shift
    path = f"{WORST}/{row:02d}_{column:02d}"
    colour = colours.by_value(np.array([predicted]))
    stream.log(path, rr.Points3D(points, colors=colour, radii=0.04), static=True)
    label = rr.Points3D(
        [shift + np.array([0, 1.4, 0])],
        labels=[f"{words}, q-hat {predicted:.2f}"],
        radii=0.01,
        colors=colours.PALETTE[7],
    )
    stream.log(f"{path}/label", label, static=True)


def _row(name: str, group: Mapping[str, Any]) -> str:
    errors = " | ".join(f"{error:.4f}" for error in group["errors"].values())
    return f"| {name} | {group['grasps']} | {group['mean_q']:.3f} | {errors} |"
