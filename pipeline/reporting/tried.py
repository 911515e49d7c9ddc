"""What came of tried grasps against q-hat, as a page."""

from collections.abc import Mapping, Sequence
from typing import Any

from pipeline.reporting.page import cell


def tried_page(
    rankings: Mapping[str, Mapping[str, Any]],
    outcomes: Mapping[str, int],
    judges: Sequence[str],
    plot: str,
) -> str:
    """The page in Markdown.

    Parameters
    ----------
    rankings
        Name of a source of q-hat → figures of `against_outcomes` on the same contacts.
    outcomes
        How an attempt ended → how many did.
    judges
        What decided how they ended.
    plot
        Path of the plot as the page names it.

    Returns
    -------
    The text.
    """
    first = next(iter(rankings.values()))
    attempts = sum(outcomes.values())
    rows = "\n".join(
        f"| {cell(name)} | {_of(found['auroc'])} | {found['brier']:.3f} "
        f"| {found['mean_predicted']:.2f} |"
        for name, found in rankings.items()
    )
    bins = "\n".join(
        f"| {cell(name)} | {one['from']:.1f} to {one['to']:.1f} | {one['contacts']} "
        f"| {one['mean_predicted']:.2f} | {100 * one['share']:.0f} % "
        f"| {100 * one['interval_95'][0]:.0f} to {100 * one['interval_95'][1]:.0f} % |"
        for name, found in rankings.items()
        for one in found["bins"]
    )
    causes = "\n".join(f"| {cell(cause)} | {count} |" for cause, count in outcomes.items())
    low, high = first["interval_95"]
    return (
        "# Tried grasps against q-hat\n\n"
        f"{attempts} attempts, judged by {', '.join(judges)}; {first['contacts']} contacts were "
        f"sealed, {first['lifted']} lifted an object to the attempt's end: "
        f"{100 * first['share']:.0f} % (95 %: {100 * low:.0f} to {100 * high:.0f}). Attempts that "
        "never sealed say nothing of q-hat and are not among the contacts. Only what looked good "
        "was tried, so AUROC is of a narrow range of q-hat, and lower than over all grasps; and "
        "q-hat is no probability: what was lifted depends on weights and motions that q knows "
        "nothing of. Contacts of one attempt and object are not independent: intervals are "
        "too narrow by that.\n\n"
        "| ranking, on the same clouds | AUROC | Brier | mean q-hat |\n|-|-|-|-|\n"
        f"{rows}\n\n"
        f"![Share lifted by q-hat]({plot})\n\n"
        "| ranking | q-hat | contacts | mean q-hat | lifted | 95 % |\n|-|-|-|-|-|-|\n"
        f"{bins}\n\n"
        "| attempts ended with | how many |\n|-|-|\n"
        f"{causes}\n"
    )


def _of(value: float | None) -> str:
    return "one outcome only" if value is None else f"{value:.2f}"
