"""Compare a run's figures with a reference: each quantity has a name and a tolerance."""

from collections.abc import Iterator
from dataclasses import dataclass

Value = float | int | str
Figures = dict[str, dict[str, Value]]
"""Group → item → value: ``figures["nsvr"]["bowl"]``."""


@dataclass(frozen=True)
class Rule:
    """Name and tolerance of the quantities of a group.

    Attributes
    ----------
    name
        Name of a quantity; ``{}`` stands for the item.
    unit
        Unit written after the value.
    absolute
        Greatest allowed difference.
    relative
        Greatest allowed difference as a share of the reference's value. The larger of ``absolute``
        and this one counts; where both are 0, values must be equal.
    between
        Groups of the reference that hold the least and the greatest allowed value of each item.
    each_in_run
        Whether every item of the reference must be in the run.
    compared
        Whether the group is compared; groups that hold bounds are not.
    """

    name: str
    unit: str = ""
    absolute: float = 0.0
    relative: float = 0.0
    between: tuple[str, str] | None = None
    each_in_run: bool = True
    compared: bool = True


def _bound(name: str) -> Rule:
    return Rule(name, compared=False)


# Numbers that arithmetic alone decides are held tightly, those of a chaotic settling loosely. What
# a renderer decides has bounds for each; what a training decides has those that trainings under
# several instruction sets gave (`spread`).
RULES = {
    "nsvr": Rule("NSVR of {}", relative=1e-6),
    "shape_class": Rule("class of {}"),
    "split": Rule("split of {}"),
    "placed": Rule("objects of scene {}"),
    "gap_mm": Rule("gap of {}", "mm", absolute=0.05),
    "stacked_gap_mm": Rule("gap of {}", "mm", absolute=1.0),
    "grasps": Rule("number of {}"),
    "q_histogram": Rule("grasps with q in {}", absolute=30, relative=0.1),
    "baseline_error": Rule("test error of baseline {}", absolute=0.02),
    "pad_q": Rule("q of {}", absolute=1e-6),
    "pad_status": Rule("status of {}"),
    "prediction": Rule("q-hat of the kept network for {}", absolute=1e-5),
    "control_prediction": Rule("q-hat in control of the kept network for {}", absolute=1e-5),
    # A hundred times what Embree's pictures of run ci moved it by against SAPIEN's (2e-5).
    "kept_error": Rule(
        "test error of the kept network, pictures by {}", absolute=2e-3, each_in_run=False
    ),
    "network": Rule("{} of the network"),
    "trained": Rule("{}", between=("trained_low", "trained_high")),
    "trained_low": _bound("least {}"),
    "trained_high": _bound("greatest {}"),
    "lifted": Rule("share of objects lifted at {}", between=("lifted_low", "lifted_high")),
    "lifted_low": _bound("least share of objects lifted at {}"),
    "lifted_high": _bound("greatest share of objects lifted at {}"),
}


@dataclass(frozen=True)
class Difference:
    """A quantity that differs from the reference by more than its tolerance."""

    quantity: str
    before: str
    now: str
    allowed: str

    def __str__(self) -> str:
        return f"{self.quantity}: {self.before} → {self.now} ({self.allowed})"


def differences(now: Figures, reference: Figures) -> Iterator[Difference]:
    """Every quantity outside of what it may move, in the order of ``RULES``.

    Parameters
    ----------
    now
        The run's figures.
    reference
        What they are held against: groups of values, and of bounds.

    Yields
    ------
    Difference
        One quantity that moved too far.
    """
    for group, rule in RULES.items():
        if not rule.compared:
            continue
        before, after = reference.get(group, {}), now.get(group, {})
        if not rule.each_in_run:
            before = {item: value for item, value in before.items() if item in after}
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
