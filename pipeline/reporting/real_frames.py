"""Trials on real frames as figures and as a page."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pipeline.camera.trial import FrameTrial, Stability
from pipeline.config.predict import PredictConfig
from pipeline.reporting.page import cell


def trial_figures(
    trials: Sequence[FrameTrial], unreadable: Mapping[str, str], apart_m: float
) -> dict[str, Any]:
    """Figures of all trials together and of each.

    Parameters
    ----------
    trials
        All of them.
    unreadable
        Name of a frame that could not be read → why, one sentence.
    apart_m
        A first choice that moves by less than this stays where it is [m].

    Returns
    -------
    What becomes JSON: ``together``, ``trials`` and ``unreadable``.
    """
    groups: dict[tuple[str, bool], list[FrameTrial]] = {}
    for trial in trials:
        groups.setdefault((trial.ranking, trial.kept_to_mask), []).append(trial)
    return {
        "together": [
            {"ranking": ranking, "kept_to_mask": kept, **_together(group, apart_m)}
            for (ranking, kept), group in groups.items()
        ],
        "trials": [_one(trial, apart_m) for trial in trials],
        "unreadable": dict(unreadable),
    }


def trial_page(figures: Mapping[str, Any], config: PredictConfig, sheet: str) -> str:
    """The page in Markdown.

    Parameters
    ----------
    figures
        Of `trial_figures`.
    config
        How frames were tried.
    sheet
        Path of the sheet as the page names it.

    Returns
    -------
    The text, with the sheet shown in it.
    """
    trial = config.trial
    together = "\n".join(
        f"| {cell(row['ranking'])} | {'within the mask' if row['kept_to_mask'] else 'everywhere'} "
        f"| {row['frames']} | {row['with_a_choice']} | {row['good']} "
        f"| {_of(row['in_mask'], row['masked'])} | {_of(row['off_edges'], row['with_a_choice'])} "
        f"| {_of(row['in_mask_and_off_edges'], row['masked'])} "
        f"| {_seconds(row['seconds'])} |"
        for row in figures["together"]
    )
    stability = "\n".join(
        f"| {cell(row['ranking'])} | {'within the mask' if row['kept_to_mask'] else 'everywhere'} "
        f"| {change} | {_share(row[name]['stays'])} | {_share(row[name]['good_stays'])} "
        f"| {_quality(row[name]['quality_change'])} | {_share(row[name]['found_again'])} |"
        for row in figures["together"]
        for name, change in (("redrawn", "contacts drawn anew"), ("thinned", "pixels lost"))
    )
    each = "\n".join(
        f"| {cell(row['frame'])} | {cell(row['ranking'])} "
        f"| {'mask' if row['kept_to_mask'] else 'everywhere'} | {_quality(row['quality'])} "
        f"| {_word(row['in_mask'])} | {_word(row['off_edges'])} "
        f"| {_moved(row['redrawn_moved_mm'])} | {_moved(row['thinned_moved_mm'])} "
        f"| {cell(row['refused'])} |"
        for row in figures["trials"]
    )
    unreadable = "".join(
        f"- {cell(name)}: {cell(why)}\n" for name, why in figures["unreadable"].items()
    )
    return (
        "# First choices on real frames\n\n"
        "No robot tried them: what is told is whether a first choice lies in the mask that a "
        f"person drew, whether the surface goes on around it (within {trial.edge_clear_share:g} "
        f"of the pad's radius at most {100 * trial.edge_share_max:.0f} % of it is empty, beside "
        f"the mask, or more than {1e3 * trial.edge_jump_m:.0f} mm off the pad's plane), and what "
        f"becomes of it when other contacts are drawn and when {100 * trial.lost_share:.0f} % of "
        f"the pixels are lost, {trial.repeats} times each: it stays within "
        f"{1e3 * config.apart_m:.0f} mm, or moves to a place whose q-hat is as high, as on the "
        f"face of a large box; and how many of the best {trial.compared} places are among the "
        f"best {trial.compared} again. Good is a q-hat of {config.quality_min:.2f} and more. "
        f"Approaches are up to {np.degrees(trial.tilt_max_rad):.0f} degrees off the vertical.\n\n"
        "| ranking | grasps | frames | with a choice | good | in the mask | off edges "
        "| both | median time |\n"
        "|-|-|-|-|-|-|-|-|-|\n"
        f"{together}\n\n"
        "| ranking | grasps | change | first choice stays | stays, where it is good "
        "| q-hat of the first choice changes by (median) | of the best places found again |\n"
        "|-|-|-|-|-|-|-|\n"
        f"{stability}\n\n"
        + (f"Frames that cannot be read:\n\n{unreadable}\n" if unreadable else "")
        + f"![Top choices by frame]({sheet})\n\n"
        "| frame | ranking | grasps | q-hat | in the mask | off edges | moves when redrawn, mm "
        "| moves when pixels are lost, mm | refused |\n|-|-|-|-|-|-|-|-|-|\n"
        f"{each}\n"
    )


def _together(group: Sequence[FrameTrial], apart_m: float) -> dict[str, Any]:
    firsts = [trial.first for trial in group if trial.first is not None]
    masked = [first for first in firsts if first.in_mask is not None]
    return {
        "frames": len(group),
        "with_a_choice": len(firsts),
        "good": sum(bool(trial.prediction and trial.prediction.good) for trial in group),
        "masked": sum(not trial.frame.allowed.all() for trial in group),
        "in_mask": sum(bool(first.in_mask) for first in masked),
        "off_edges": sum(first.off_edges for first in firsts),
        "in_mask_and_off_edges": sum(bool(first.in_mask) and first.off_edges for first in masked),
        "redrawn": _stability([(trial, trial.redrawn) for trial in group], apart_m),
        "thinned": _stability([(trial, trial.thinned) for trial in group], apart_m),
        "seconds": _median([trial.seconds for trial in group]),
    }


def _one(trial: FrameTrial, apart_m: float) -> dict[str, Any]:
    first = trial.first
    return {
        "frame": trial.frame.name,
        "ranking": trial.ranking,
        "kept_to_mask": trial.kept_to_mask,
        "refused": trial.refused,
        "grasps": len(trial.prediction.proposals) if trial.prediction else 0,
        "quality": round(first.quality, 4) if first else None,
        "in_mask": first.in_mask if first else None,
        "off_edges": first.off_edges if first else None,
        "redrawn_moved_mm": _millimetres(trial.redrawn),
        "thinned_moved_mm": _millimetres(trial.thinned),
        "redrawn": _stability([(trial, trial.redrawn)], apart_m),
        "thinned": _stability([(trial, trial.thinned)], apart_m),
        "seconds": _median([trial.seconds]),
    }


def _stability(
    found: Sequence[tuple[FrameTrial, Stability | None]], apart_m: float
) -> dict[str, float | None]:
    """What becomes of first choices under one kind of change, over all draws."""
    there = [(trial, one) for trial, one in found if one is not None]
    good = [one for trial, one in there if trial.prediction is not None and trial.prediction.good]
    each = [one for _, one in there]
    return {
        "stays": _mean([one.moved_m < apart_m for one in each]),
        "good_stays": _mean([one.moved_m < apart_m for one in good]),
        "quality_change": (
            float(np.median(np.abs(np.concatenate([one.quality_change for one in each]))))
            if each
            else None
        ),
        "found_again": _mean([one.found_again for one in each]),
    }


def _mean(arrays: Sequence[np.ndarray]) -> float | None:
    """Mean over all entries; None where there are none."""
    return float(np.mean(np.concatenate(arrays))) if arrays else None


def _millimetres(found: Stability | None) -> list[float | None]:
    if found is None:
        return []
    return [round(1e3 * float(m), 1) if np.isfinite(m) else None for m in found.moved_m]


def _median(seconds: Sequence[float]) -> float | None:
    """Median of those that there are: a frame that is refused has no time."""
    there = [value for value in seconds if np.isfinite(value)]
    return float(np.median(there)) if there else None


def _seconds(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f} s"


def _of(number: int, total: int) -> str:
    return f"{number} of {total}" if total else "-"


def _share(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.0f} %"


def _quality(quality: float | None) -> str:
    return "none" if quality is None else f"{quality:.2f}"


def _word(value: bool | None) -> str:
    return "-" if value is None else ("yes" if value else "no")


def _moved(millimetres: Sequence[float | None]) -> str:
    return ", ".join("none left" if m is None else f"{m:.0f}" for m in millimetres) or "-"
