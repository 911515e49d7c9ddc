"""Subsets are even over the classes, splits never share an object."""

from hypothesis import given
from hypothesis import strategies as st

from pipeline.config import SplitConfig
from pipeline.geometry.selection import choose_split, choose_subset
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


@given(CLASSES, st.integers(0, 2**32))
def test_every_class_of_three_is_in_every_split(classes: dict[str, ShapeClass], seed: int) -> None:
    split = choose_split(classes, SplitConfig(), seed)
    assert set(split) == set(classes)
    for kind in ShapeClass:
        mine = {split[name] for name, own in classes.items() if own is kind}
        count = sum(own is kind for own in classes.values())
        if count >= 3:
            assert mine == {"train", "val", "test"}
        elif count:
            assert "train" in mine


@given(CLASSES, st.integers(0, 2**32))
def test_order_of_the_mapping_decides_nothing(classes: dict[str, ShapeClass], seed: int) -> None:
    backwards = dict(reversed(classes.items()))
    assert choose_split(classes, SplitConfig(), seed) == choose_split(
        backwards, SplitConfig(), seed
    )
    assert choose_subset(classes, 3, seed) == choose_subset(backwards, 3, seed)
