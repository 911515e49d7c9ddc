"""Subsets are even over the classes, splits never share a family."""

from hypothesis import given
from hypothesis import strategies as st

from pipeline.config import SplitConfig
from pipeline.geometry.selection import Split, choose_split, choose_subset
from pipeline.geometry.shape import ShapeClass

CLASSES = st.dictionaries(
    st.text("abcdefgh", min_size=1, max_size=5), st.sampled_from(list(ShapeClass)), min_size=1
)


@given(CLASSES, st.integers(0, 30), st.integers(0, 2**32))
def test_a_subset_is_even_over_classes(
    classes: dict[str, ShapeClass], limit: int, seed: int
) -> None:
    chosen = choose_subset(classes, limit, seed)
    assert set(chosen) <= set(classes)
    assert len(chosen) == (len(classes) if limit == 0 else min(limit, len(classes)))
    taken = {kind: sum(classes[n] is kind for n in chosen) for kind in ShapeClass}
    there = {kind: sum(k is kind for k in classes.values()) for kind in ShapeClass}
    for kind, count in taken.items():
        # A class that gave less than another gave all it had.
        assert count == there[kind] or count >= max(taken.values()) - 1


@given(CLASSES, CLASSES, st.integers(1, 30), st.integers(0, 2**32))
def test_a_subset_stays_when_others_come_or_go(
    first: dict[str, ShapeClass], more: dict[str, ShapeClass], limit: int, seed: int
) -> None:
    before = choose_subset(first, limit, seed)
    after = choose_subset(more | first, limit, seed, before)
    assert set(before) <= set(after)
    assert len(after) == min(limit, len(more | first))
    assert set(after) - set(before) <= set(more)
    rest = {name: kind for name, kind in first.items() if name != before[0]}
    again = choose_subset(rest, limit, seed, before)
    assert set(before) - set(again) == {before[0]}
    assert set(choose_subset(first, 1, seed, before)) <= set(before)


def alone(classes: dict[str, ShapeClass]) -> dict[str, str]:
    """Every object is a family of its own."""
    return {name: name for name in classes}


@given(CLASSES, st.integers(0, 2**32))
def test_every_class_of_three_is_in_every_split(classes: dict[str, ShapeClass], seed: int) -> None:
    split = choose_split(classes, SplitConfig(), seed, alone(classes), {})
    assert set(split) == set(classes)
    for kind in ShapeClass:
        mine = {split[name] for name, own in classes.items() if own is kind}
        count = sum(own is kind for own in classes.values())
        if count >= 3:
            assert mine == {"train", "val", "test"}
        elif count:
            assert "train" in mine


@given(
    CLASSES,
    st.lists(st.integers(0, 8), min_size=1),
    st.dictionaries(st.integers(0, 8), st.sampled_from(["train", "val", "test"])),
    st.integers(0, 2**32),
)
def test_a_family_is_in_one_split_and_where_it_was_settled(
    classes: dict[str, ShapeClass], kin: list[int], settled: dict[int, Split], seed: int
) -> None:
    family_of = {name: f"f{kin[k % len(kin)]}" for k, name in enumerate(sorted(classes))}
    family_of |= {f"of f{k}": f"f{k}" for k in settled}
    fixed = {f"of f{k}": where for k, where in settled.items()}
    split = choose_split(classes, SplitConfig(), seed, family_of, fixed)
    assert set(split) == set(classes)
    where_is: dict[str, str] = {f"f{k}": where for k, where in settled.items()}
    for name, where in split.items():
        assert where_is.setdefault(family_of[name], where) == where


@given(CLASSES, st.integers(0, 2**32))
def test_what_is_settled_gives_the_same_splits_again(
    classes: dict[str, ShapeClass], seed: int
) -> None:
    split = choose_split(classes, SplitConfig(), seed, alone(classes), {})
    assert choose_split(classes, SplitConfig(), seed + 1, alone(classes), split) == split


def test_a_large_family_does_not_swallow_the_test_split() -> None:
    """Twenty balls of one family and nine other shapes: the balls are trained on."""
    classes = dict.fromkeys([f"ball_{k}" for k in range(20)], ShapeClass.BASIC)
    classes |= dict.fromkeys([f"box_{k}" for k in range(9)], ShapeClass.BASIC)
    family_of = {name: "ball_0" if name.startswith("ball") else name for name in classes}
    for seed in range(20):
        split = choose_split(classes, SplitConfig(), seed, family_of, {})
        assert split["ball_3"] == "train"
        assert sum(where == "test" for where in split.values()) == 7


@given(CLASSES, st.integers(0, 2**32))
def test_order_of_the_mapping_decides_nothing(classes: dict[str, ShapeClass], seed: int) -> None:
    backwards = dict(reversed(classes.items()))
    assert choose_split(classes, SplitConfig(), seed, alone(classes), {}) == choose_split(
        backwards, SplitConfig(), seed, alone(backwards), {}
    )
    assert choose_subset(classes, 3, seed) == choose_subset(backwards, 3, seed)
