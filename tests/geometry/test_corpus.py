"""Every file of the corpus is read right, or refused with the reason that is true."""

import math
import re
from pathlib import Path

import pytest

from pipeline.config import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.catalogue import MeasuredObject, measure_object
from pipeline.geometry.shape import outer_surface, surface_area, volume
from pipeline.geometry.urdf_files import load_object_file
from tests.geometry.corpus import corpus_cases
from tests.geometry.corpus.case import Case, write
from tests.geometry.corpus.folder_cases import folder_cases
from tests.geometry.corpus.page import PAGE, objects_of, page

CONFIG = ObjectsConfig(rescaled=False)
CASES = {case.name: case for case in corpus_cases()}
GOOD = [name for name, case in CASES.items() if case.solid is not None]
FOLDERS = {case.name: case for case in folder_cases()}
BAD = [name for name, case in CASES.items() if case.solid is None]


def measured(case: Case, folder: Path) -> MeasuredObject:
    path = write(case, folder)
    return measure_object(load_object_file(path, folder, "object", CONFIG), CONFIG)


@pytest.mark.parametrize("name", GOOD)
def test_a_file_is_read_right(tmp_path: Path, name: str) -> None:
    case = CASES[name]
    item = measured(case, tmp_path)
    assert case.solid is not None
    assert volume(item.mesh) == pytest.approx(case.solid.volume_m3, rel=case.tolerance)
    outer = outer_surface(item.mesh)
    assert surface_area(outer) == pytest.approx(case.solid.area_m2, rel=case.tolerance)
    assert item.nsvr == pytest.approx(case.solid.nsvr, rel=case.tolerance)
    assert case.recorded in " ".join(item.repairs)


@pytest.mark.parametrize("name", BAD)
def test_a_file_is_refused_with_the_true_reason(tmp_path: Path, name: str) -> None:
    case = CASES[name]
    with pytest.raises(MeshError, match=case.refused) as refusal:
        measured(case, tmp_path)
    assert Path(name).name in refusal.value.what
    assert refusal.value.remedy
    assert ("truncated" in str(refusal.value)) == ("truncated" in case.refused)


@pytest.mark.parametrize("name", FOLDERS)
def test_a_folder_is_the_objects_that_it_holds(tmp_path: Path, name: str) -> None:
    assert objects_of(FOLDERS[name], tmp_path) == FOLDERS[name].objects


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
