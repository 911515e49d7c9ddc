"""Figures against figures: every quantity has a name that a person reads, and what it may move."""

from collections.abc import Iterator
from dataclasses import dataclass

Value = float | int | str
Figures = dict[str, dict[str, Value]]
"""Group → item → value: ``figures["nsvr"]["bowl"]``."""


@dataclass(frozen=True)
class Rule:
    """How the quantities of a group are called and how far one may move.

    Attributes
    ----------
    name
        Of one of them, its item in place of ``{}``.
    absolute, relative
        The larger of both is allowed; none of both means equal.
    between
        Groups that hold the least and the greatest value allowed, item by item.
    """

    name: str
    unit: str = ""
    absolute: float = 0.0
    relative: float = 0.0
    between: tuple[str, str] | None = None
    compared: bool = True


# Numbers that arithmetic alone decides are held tightly; what a chaotic settling, a training or
# a few attempts decide gets the room that another processor or renderer takes.
RULES = {
    "nsvr": Rule("NSVR of {}", relative=1e-6),
    "shape_class": Rule("class of {}"),
    "split": Rule("split of {}"),
    "placed": Rule("objects of scene {}"),
    "gap_mm": Rule("gap of {}", "mm", absolute=0.05),
    "stacked_gap_mm": Rule("gap of {}", "mm", absolute=1.0),
    "grasps": Rule("number of {}"),
    "q_histogram": Rule("grasps with q in {}", absolute=30, relative=0.1),
    "pad_q": Rule("q of {}", absolute=1e-6),
    "pad_status": Rule("status of {}"),
    "network": Rule("{} of the network"),
    "error": Rule("{}", absolute=0.02),
    "success": Rule("success at {}", between=("success_low", "success_high")),
    "success_low": Rule("least success at {}", compared=False),
    "success_high": Rule("greatest success at {}", compared=False),
}


@dataclass(frozen=True)
class Difference:
    """One quantity that is not as the reference has it."""

    quantity: str
    before: str
    now: str
    allowed: str

    def __str__(self) -> str:
        return f"{self.quantity}: {self.before} → {self.now} ({self.allowed})"


def differences(now: Figures, reference: Figures) -> Iterator[Difference]:
    """Every quantity outside of what it may move, in the order of ``RULES``."""
    for group, rule in RULES.items():
        if not rule.compared:
            continue
        before, after = reference.get(group, {}), now.get(group, {})
        for item in [*before, *(item for item in after if item not in before)]:
            name = rule.name.format(item)
            was, there = _shown(before.get(item), rule), _shown(after.get(item), rule)
            if item not in after or item not in before:
                yield Difference(name, was, there, "must be in both")
                continue
            fits, allowed = _allowed(rule, item, after[item], before[item], reference)
            if not fits:
                yield Difference(name, was, there, allowed)


def compared_count(figures: Figures) -> int:
    """How many quantities are held against the reference."""
    return sum(len(items) for group, items in figures.items() if RULES[group].compared)


def _allowed(
    rule: Rule, item: str, now: Value, before: Value, reference: Figures
) -> tuple[bool, str]:
    """Whether a value fits, and what would."""
    if rule.between is not None:
        low, high = (float(reference[group][item]) for group in rule.between)
        return low <= float(now) <= high, f"allowed {low:.3g} to {high:.3g}"
    room = max(rule.absolute, rule.relative * abs(float(before)) if rule.relative else 0.0)
    if room == 0.0:
        return now == before, "must be equal"
    return abs(float(now) - float(before)) <= room, f"allowed ± {room:.2g}{_unit(rule)}"


def _shown(value: Value | None, rule: Rule) -> str:
    if value is None:
        return "absent"
    return (f"{value:.7g}" if isinstance(value, float) else str(value)) + _unit(rule)


def _unit(rule: Rule) -> str:
    return f" {rule.unit}" if rule.unit else ""
