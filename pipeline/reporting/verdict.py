"""Success of two runs policy by policy, and one sentence on what chance may explain."""

from dataclasses import dataclass

from pipeline.control.success import Outcome, advantage
from pipeline.reporting.differences import CHANCE, Distance
from pipeline.reporting.two_runs import Side


@dataclass(frozen=True)
class SuccessChange:
    """One policy in both runs; paired where both tried the same clutters.

    Attributes
    ----------
    policy
        Its name.
    clutters
        How many, of both or of either.
    paired
        Whether both tried the same ones.
    rates
        Mean success over clutters, of either side.
    p
        Paired by clutter, or Fisher's exact test on all attempts.
    """

    policy: str
    clutters: int
    paired: bool
    rates: tuple[float, float]
    p: float


def success_changes(a: Side, b: Side) -> list[SuccessChange]:
    """Every policy that both runs tried, paired by clutter where the clutters are the same."""
    found = []
    for policy in a.outcomes:
        if policy not in b.outcomes:
            continue
        mine, other = a.outcomes[policy], b.outcomes[policy]
        same = sorted(mine.keys() & other.keys())
        if same:
            gain = advantage([mine[c] for c in same], [other[c] for c in same])
            rates, p = (gain.rate, gain.baseline_rate), gain.p_paired
        else:
            both = [all_of(list(side.values())) for side in (mine, other)]
            gain = advantage(both[:1], both[1:])
            rates, p = (gain.rate, gain.baseline_rate), gain.p_fisher
        clutters = len(same) or min(len(mine), len(other))
        found.append(SuccessChange(policy, clutters, bool(same), rates, p))
    return found


def all_of(outcomes: list[Outcome]) -> Outcome:
    """All attempts together."""
    return Outcome(sum(o.lifted for o in outcomes), sum(o.attempts for o in outcomes))


def verdict(distances: list[Distance], p_error: float | None, success: list[SuccessChange]) -> str:
    """One sentence that says what is due to chance and what is not."""
    tests = {"labels as a whole": distances[0].p if distances else None}
    tests["errors by object"] = p_error
    tests |= {f"success of {row.policy}": row.p for row in success}
    told = {name: p for name, p in tests.items() if p is not None}
    if not told:
        return "There is too little in both to tell chance from change."
    real = [f"{name} (p = {p:.3g})" for name, p in told.items() if p <= CHANCE]
    chance = [f"{name} (p = {p:.3g})" for name, p in told.items() if p > CHANCE]
    words = []
    if real:
        words.append(f"More than chance: {', '.join(real)}.")
    if chance:
        words.append(f"Chance may explain: {', '.join(chance)}.")
    return " ".join(words)
