"""The results of an evaluation as Markdown tables."""

from collections.abc import Sequence
from pathlib import Path

from pipeline.artifacts import open_artifact
from pipeline.messages.proposed_contacts import Proposed
from pipeline.recording.proposed_contacts import precision_markdown
from schemas.softgrip.v1.evaluation_pb2 import Comparison, LevelResult, RankedPrecision


def read_tables(path: Path) -> str:
    """All tables of an evaluate artifact as Markdown: `results_markdown`, then precision."""
    with open_artifact(path) as artifact:
        levels = [message for _, message in artifact.messages(LevelResult, "/levels")]
        policies = [message for _, message in artifact.messages(LevelResult, "/policies")]
        comparisons = [message for _, message in artifact.messages(Comparison)]
        curve = [message for _, message in artifact.messages(LevelResult, "/imperfection")]
        precisions = [message for _, message in artifact.messages(RankedPrecision)]
    tables = results_markdown(levels, policies, comparisons) + curve_markdown(curve)
    if not precisions:
        return tables
    ranked = Proposed((), precisions, None).summary()["average_precision"]
    return f"{tables}\n{precision_markdown(ranked)}"


def results_markdown(
    levels: Sequence[LevelResult],
    policies: Sequence[LevelResult],
    comparisons: Sequence[Comparison],
) -> str:
    """Write the results as Markdown: each policy by level, then all policies over all levels.

    Parameters
    ----------
    levels
        Result of each policy at each level.
    policies
        Result of each policy over all levels.
    comparisons
        The first policy against each other one.

    Returns
    -------
    Markdown.
    """
    parts = [_policy_table(p.policy, [r for r in levels if r.policy == p.policy]) for p in policies]
    rows = "\n".join(
        f"| {p.policy} | {_rate(p)} | {p.lifted} / {p.objects} | {p.cleared} / {p.clutters} "
        f"| {_at_first(p)} | {_seals_an_object(p)} | {p.seconds_a_pick:.1f} "
        f"| {p.picks_an_hour:.0f} | {_carried(p)} | {_of_liftable(p)} |"
        for p in policies
    )
    parts.append(
        "### All levels\n\n"
        "| policy | success (95 % interval) | objects lifted | clutters cleared "
        "| success at the first seal | seals an object | seconds a pick | picks an hour "
        "| attempts that bore a transport | lifted of what can be lifted "
        f"|\n|-|-|-|-|-|-|-|-|-|-|\n{rows}\n"
    )
    if comparisons:
        parts.append(_comparison_table(comparisons))
    return "\n".join(parts)


def curve_markdown(curve: Sequence[LevelResult]) -> str:
    """Success by the size of the robot's errors, a row a policy; empty where it was not asked."""
    if not curve:
        return ""
    scales = sorted({point.imperfection_scale for point in curve})
    rows = []
    for policy in dict.fromkeys(point.policy for point in curve):
        own = {point.imperfection_scale: point for point in curve if point.policy == policy}
        rows.append(f"| {policy} | " + " | ".join(_rate(own[scale]) for scale in scales) + " |")
    heads = " | ".join(f"{scale:g} times" for scale in scales)
    return (
        f"\n### By the robot's errors, at {curve[0].clutters} clutters\n\n"
        f"| policy | {heads} |\n|-|{'-|' * len(scales)}\n" + "\n".join(rows) + "\n"
    )


def _policy_table(policy: str, levels: Sequence[LevelResult]) -> str:
    rows = "\n".join(
        f"| {r.level} | {r.lifted} / {r.attempts} | {_rate(r)} | {r.cleared} / {r.clutters} "
        f"| {', '.join(f'{cause} {n}' for cause, n in sorted(r.failures.items())) or 'none'} |"
        for r in levels
    )
    return (
        f"### {policy}\n\n| level | lifted | success (95 % interval) | cleared | failures |\n"
        f"|-|-|-|-|-|\n{rows}\n"
    )


def _comparison_table(comparisons: Sequence[Comparison]) -> str:
    rows = "\n".join(
        f"| {c.baseline} | {100 * c.success_rate:.1f} % | {100 * c.baseline_success_rate:.1f} % "
        f"| {c.clutters} | {c.p_paired:.2g} | {c.p_fisher:.2g} |"
        for c in comparisons
    )
    return (
        f"### {comparisons[0].policy} against\n\n"
        "| baseline | success, mean over clutters | baseline's | clutters "
        f"| p, paired by clutter | p, Fisher |\n|-|-|-|-|-|-|\n{rows}\n"
    )


def _at_first(r: LevelResult) -> str:
    return f"{100 * r.lifted_at_first_seal / max(r.attempts, 1):.0f} %"


def _seals_an_object(r: LevelResult) -> str:
    return f"{r.seals / r.lifted:.2f}" if r.lifted else "none lifted"


def _carried(r: LevelResult) -> str:
    found = sorted(r.carried.items(), key=lambda one: float(one[0]))
    return ", ".join(f"{count} at {level} m/s²" for level, count in found) or "none"


def _of_liftable(r: LevelResult) -> str:
    """Objects lifted over those that some pose lifts; and success of attempts at these."""
    if r.liftable == 0:
        return "not looked for"
    attempts = max(r.attempts_at_liftable, 1)
    return (
        f"{r.lifted} / {r.liftable} ({100 * r.lifted / r.liftable:.0f} %), "
        f"{100 * r.lifted / attempts:.0f} % of attempts at these"
    )


def _rate(r: LevelResult) -> str:
    return f"{100 * r.success_rate:.0f} % ({100 * r.interval_low:.0f}-{100 * r.interval_high:.0f})"
