"""Names are readable in any script, fit for files, distinct, and stay when files are added."""

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.artifacts.names import file_name
from pipeline.geometry.object_names import distinct_names, is_named, readable_name
from pipeline.geometry.settled import Settled

LABELS = st.text(
    st.characters(codec="utf-8", exclude_characters="\0/"), min_size=1, max_size=80
).filter(lambda part: not part.startswith("."))


@pytest.mark.parametrize(
    ("label", "name"),
    [
        ("002_master_chef_can.ply", "002_master_chef_can"),
        ("My Cup.stl", "my_cup"),
        ("a__b/c-1.obj", "a__b_c-1"),
        ("звезда.ply", "звезда"),
        ("Кружка №3.ply", "кружка_3"),
        ("杯子.ply", "杯子"),
        ("カップ.ply", "カップ"),
        ("तश्तरी.ply", "तश्तरी"),
        ("فنجان.ply", "فنجان"),
        (unicodedata.normalize("NFD", "Tüte é.ply"), "tüte_é"),
    ],
)
def test_a_name_is_the_files_in_its_own_script(label: str, name: str) -> None:
    assert readable_name(label) == name == file_name(name)


def test_a_path_without_letters_has_digits_of_its_own() -> None:
    names = {readable_name(label) for label in ("!.ply", "?.ply", "📦.ply")}
    assert len(names) == 3
    assert all(name.startswith("object-") for name in names)


@given(st.lists(LABELS, min_size=1, max_size=6, unique=True))
def test_names_are_distinct_fit_for_files_and_independent_of_order(parts: list[str]) -> None:
    labels = [f"{part}.ply" for part in parts]
    names = distinct_names(labels, {})
    assert [file_name(name) for name in names.values()] == list(names.values())
    assert len(set(names.values())) == len(labels)
    assert distinct_names(labels[::-1], {}) == names


@given(st.lists(LABELS, min_size=2, max_size=6, unique=True))
def test_names_stay_when_files_are_added(parts: list[str]) -> None:
    """Files whose names meet no other's need no record of them; with it, no file's name changes."""
    labels = [f"{part}.ply" for part in parts]
    few, all_of_them = distinct_names(labels[1:], {}), distinct_names(labels, {})
    others = {label for label in labels[1:] if readable_name(label) != readable_name(labels[0])}
    assert {at: few[at] for at in others} == {at: all_of_them[at] for at in others}
    again = distinct_names(labels, few)
    assert {label: again[label] for label in few} == few


def test_where_two_files_want_one_name_the_one_that_is_written_so_has_it() -> None:
    names = distinct_names(["Mug 1.ply", "mug_1.ply", "mug_1.obj", "mug-1.ply"], {})
    assert names["mug_1.obj"] == "mug_1"
    assert names["mug-1.ply"] == "mug-1"
    for label in ("Mug 1.ply", "mug_1.ply"):
        assert names[label].startswith("mug_1-")
        assert len(names[label]) == len("mug_1-") + 6


def test_a_file_that_is_gone_keeps_its_name_until_another_has_it() -> None:
    settled = Settled("x").with_names({"mug.ply": "mug", "cup.ply": "cup"})
    assert distinct_names(["mug.obj"], settled.names) == {"mug.obj": "mug"}
    now = settled.with_names({"mug.obj": "mug"})
    assert now.names == {"mug.obj": "mug", "cup.ply": "cup"}
    assert distinct_names(["mug.obj", "mug.ply"], now.names)["mug.obj"] == "mug"


def test_long_paths_are_cut_and_stay_distinct() -> None:
    names = distinct_names([f"{'杯子/' * 100}{number}.ply" for number in range(3)], {})
    assert len(set(names.values())) == 3
    assert all(len(name.encode()) < 180 for name in names.values())


def test_patterns_fit_however_letters_are_coded() -> None:
    assert is_named("tüte_1", unicodedata.normalize("NFD", "tüte*"))
    assert is_named("杯子", "杯?")
    assert not is_named("杯子", "カップ")
