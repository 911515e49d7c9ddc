"""Folds hold whole families, and tested objects of each class evenly."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.errors import ConfigError
from pipeline.geometry.folds import check_held_out, deal_families
from pipeline.geometry.shape import ShapeClass

KINDS = list(ShapeClass)


@given(
    st.lists(st.tuples(st.integers(0, 2), st.integers(1, 4), st.booleans()), min_size=4),
    st.integers(2, 4),
    st.integers(0, 2**31),
)
def test_families_stay_whole(drawn: list[tuple[int, int, bool]], folds: int, seed: int) -> None:
    family_of, classes, tested = {}, {}, set()
    for number, (kind, size, test) in enumerate(drawn):
        for k in range(size):
            name = f"f{number}-{k}"
            family_of[name], classes[name] = f"f{number}", KINDS[kind]
            tested |= {name} if test else set()
    if sum(test for _, _, test in drawn) < folds:
        with pytest.raises(ConfigError, match="folds need as many families"):
            deal_families(family_of, classes, tested, folds, seed)
        return
    fold = deal_families(family_of, classes, tested, folds, seed)
    assert set(fold) == set(family_of)
    for family in set(family_of.values()):
        assert len({fold[name] for name in fold if family_of[name] == family}) == 1
    assert {fold[name] for name in tested} == set(range(folds))


def test_each_class_is_spread_evenly() -> None:
    names = [f"{kind}-{k}" for kind in KINDS for k in range(8)]
    classes = {name: ShapeClass(name.partition("-")[0]) for name in names}
    fold = deal_families({name: name for name in names}, classes, set(names), 4, 0)
    for kind in KINDS:
        of_kind = [fold[name] for name in names if classes[name] is kind]
        assert sorted(of_kind) == [0, 0, 1, 1, 2, 2, 3, 3]


def test_a_start_must_have_held_out_all_that_is_tested() -> None:
    tested = {"mug": "a", "bowl": "b"}
    check_held_out(tested, {"a": "test", "b": "val", "c": "train"}, "solids")
    for known, why in (({"a": "test", "b": "train"}, "was trained on"), ({"a": "val"}, "unknown")):
        with pytest.raises(ConfigError, match=f"solids.*held out bowl: it .*{why}"):
            check_held_out(tested, known, "solids")
