"""Every file of the corpus is read right, or refused with the reason that is true."""

import math
import re
from pathlib import Path

import pytest

from pipeline.errors import MeshError
from pipeline.geometry.shape import outer_surface, surface_area, volume
from tests.geometry.corpus import corpus_cases, folders
from tests.geometry.corpus.page import PAGE, page
from tests.geometry.corpus.reading import objects_of, read

CASES = {case.name: case for case in corpus_cases()}
GOOD = [name for name, case in CASES.items() if case.solid is not None]
BAD = [name for name, case in CASES.items() if case.solid is None]
FOLDERS = {case.name: case for case in folders()}


@pytest.mark.parametrize("name", GOOD)
def test_a_file_is_read_right(name: str) -> None:
    case = CASES[name]
    item = read(case)
    assert not isinstance(item, MeshError), item
    assert case.solid is not None
    assert volume(item.mesh) == pytest.approx(case.solid.volume_m3, rel=case.tolerance)
    outer = outer_surface(item.mesh)
    assert surface_area(outer) == pytest.approx(case.solid.area_m2, rel=case.tolerance)
    assert item.nsvr == pytest.approx(case.solid.nsvr, rel=case.tolerance)
    assert case.recorded in " ".join(item.repairs)


@pytest.mark.parametrize("name", BAD)
def test_a_file_is_refused_with_the_true_reason(name: str) -> None:
    refusal = read(CASES[name])
    assert isinstance(refusal, MeshError)
    assert re.search(CASES[name].refused, str(refusal))
    assert Path(name).name in refusal.what
    assert refusal.remedy
    assert ("truncated" in str(refusal)) == ("truncated" in CASES[name].refused)


@pytest.mark.parametrize("name", FOLDERS)
def test_a_folder_is_the_objects_that_it_holds(name: str) -> None:
    assert objects_of(FOLDERS[name]) == FOLDERS[name].objects


def test_the_page_of_the_corpus_is_up_to_date() -> None:
    """Made again by ``python -m tests.geometry.corpus --page``."""
    assert PAGE.read_text() == page()


def test_the_answers_are_those_of_closed_forms() -> None:
    """Of two solids, worked out by hand."""
    box, notched = CASES["obj_plain.obj"].solid, CASES["polygon_notched_0.obj"].solid
    assert box is not None
    assert notched is not None
    assert box.volume_m3 == pytest.approx(0.1 * 0.07 * 0.04)
    assert box.area_m2 == pytest.approx(2 * (0.1 * 0.07 + 0.1 * 0.04 + 0.07 * 0.04))
    slant = math.hypot(0.05, 0.075)
    assert notched.volume_m3 == pytest.approx((0.01 - 0.5 * 0.1 * 0.075) * 0.05)
    assert notched.area_m2 == pytest.approx(
        2 * (0.01 - 0.5 * 0.1 * 0.075) + 0.05 * (0.3 + 2 * slant)
    )


def test_names_say_which_are_refused() -> None:
    assert {name for name in CASES if re.match("bad_", name)} == set(BAD)
