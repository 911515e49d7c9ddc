"""A difference is told by quantity, from, to and what is allowed; what may move does not count."""

import pytest

from pipeline.regression.comparison import RULES, Figures, Value, compared_count, differences

REFERENCE: Figures = {
    "nsvr": {"bowl": 3.5, "box": 2.5},
    "shape_class": {"bowl": "complex"},
    "gap_mm": {"bowl (body 1) in s": 52.0},
    "q_histogram": {"0.0 to 0.1": 400},
    "pad_q": {"pad 0": 0.8},
    "kept_error": {"sapien": 0.2, "embree": 0.21},
    "trained": {"test error": 0.2},
    "trained_low": {"test error": 0.1},
    "trained_high": {"test error": 0.25},
    "lifted": {"level 1": 0.9},
    "lifted_low": {"level 1": 0.6},
    "lifted_high": {"level 1": 0.98},
}


def changed(group: str, item: str, value: Value) -> Figures:
    return {**REFERENCE, group: {**REFERENCE[group], item: value}}


def told(now: Figures) -> list[str]:
    return [str(difference) for difference in differences(now, REFERENCE)]


def test_a_run_does_not_differ_from_itself() -> None:
    assert told(REFERENCE) == []
    assert compared_count(REFERENCE) == 10


@pytest.mark.parametrize(
    ("group", "item", "value"),
    [
        ("nsvr", "bowl", 3.500003),
        ("gap_mm", "bowl (body 1) in s", 52.04),
        ("q_histogram", "0.0 to 0.1", 440),
        ("pad_q", "pad 0", 0.8000009),
        ("kept_error", "sapien", 0.2019),
        ("trained", "test error", 0.11),
        ("lifted", "level 1", 0.61),
    ],
)
def test_what_may_move_may_move(group: str, item: str, value: Value) -> None:
    assert told(changed(group, item, value)) == []


@pytest.mark.parametrize(
    ("group", "item", "value", "said"),
    [
        ("nsvr", "bowl", 3.51, "NSVR of bowl: 3.5 → 3.51 (allowed ± 3.5e-06)"),
        ("shape_class", "bowl", "typical", "class of bowl: complex → typical (must be equal)"),
        (
            *("gap_mm", "bowl (body 1) in s", 51.9),
            "gap of bowl (body 1) in s: 52 mm → 51.9 mm (allowed ± 0.05 mm)",
        ),
        (
            *("q_histogram", "0.0 to 0.1", 441),
            "grasps with q in 0.0 to 0.1: 400 → 441 (allowed ± 40)",
        ),
        ("pad_q", "pad 0", 0.800002, "q of pad 0: 0.8 → 0.800002 (allowed ± 1e-06)"),
        (
            *("kept_error", "embree", 0.213),
            "test error of the kept network, pictures by embree: 0.21 → 0.213 (allowed ± 0.002)",
        ),
        ("trained", "test error", 0.26, "test error: 0.2 → 0.26 (allowed 0.1 to 0.25)"),
        (
            "lifted",
            "level 1",
            0.5,
            "share of objects lifted at level 1: 0.9 → 0.5 (allowed 0.6 to 0.98)",
        ),
    ],
)
def test_what_moved_too_far_is_explained(group: str, item: str, value: Value, said: str) -> None:
    assert told(changed(group, item, value)) == [said]


def test_what_is_new_or_gone_is_told() -> None:
    gone: Figures = {**REFERENCE, "nsvr": {"bowl": 3.5, "cup": 3.0}}
    assert told(gone) == [
        "NSVR of box: 2.5 → absent (must be in both)",
        "NSVR of cup: absent → 3 (must be in both)",
    ]


def test_a_run_has_the_pictures_of_one_renderer() -> None:
    assert told({**REFERENCE, "kept_error": {"sapien": 0.2}}) == []
    assert told({**REFERENCE, "kept_error": {"another": 0.2}}) == [
        "test error of the kept network, pictures by another: absent → 0.2 (must be in both)"
    ]


def test_no_number_is_compared_without_a_rule() -> None:
    with pytest.raises(KeyError):
        compared_count({"unheard of": {"x": 1.0}})
    assert all(rule.name.count("{}") == 1 for rule in RULES.values())
