"""What sizes tell of a folder's unit is told of all files together, and stays."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from pipeline.config import ObjectsConfig, SplitConfig
from pipeline.errors import ConfigError
from pipeline.geometry.catalogue import MeasuredObject, measure_object
from pipeline.geometry.mesh_files import load_mesh_file
from pipeline.geometry.plan import Plan, plan_catalogue
from pipeline.geometry.settled import Settled, read_settled
from pipeline.geometry.units import METRES_PER_UNIT, FolderUnit, folder_unit

CONFIG = ObjectsConfig(rescaled=False)


@pytest.mark.parametrize(
    ("extents", "decided"),
    [
        ((0.1, 0.3), FolderUnit("m")),
        ((3.0, 20.0, 100.0), FolderUnit("mm", ("cm",))),  # alone, the first would be three metres
        ((300.0, 0.9), FolderUnit("cm")),
        ((50.0, 120.0), FolderUnit("mm", ("cm",))),
        ((2.5, 4.0), FolderUnit("m", ("mm", "cm"))),
        ((0.1, 0.12, 90.0), FolderUnit("m", (), {"2": "mm"})),
        ((80.0, 90.0, 0.1), FolderUnit("mm", ("cm",), {"2": "m"})),
    ],
)
def test_a_folder_has_the_unit_that_most_of_its_sizes_fit(
    extents: tuple[float, ...], decided: FolderUnit
) -> None:
    sizes = {str(number): extent for number, extent in enumerate(extents)}
    assert folder_unit(sizes, CONFIG, None) == decided
    assert folder_unit(dict(reversed(sizes.items())), CONFIG, None) == decided


@given(
    st.lists(st.floats(0.002, 5.0), min_size=1, max_size=8),
    st.sampled_from(["m", "cm", "mm"]),
)
def test_a_file_is_never_read_at_a_size_out_of_bounds(sizes_m: list[float], unit: str) -> None:
    extents = {str(k): size / METRES_PER_UNIT[unit] for k, size in enumerate(sizes_m)}
    found = folder_unit(extents, CONFIG, None)
    for label, extent in extents.items():
        size_m = extent * METRES_PER_UNIT[found.of(label)]
        assert CONFIG.min_extent_m * (1 - 1e-9) <= size_m <= CONFIG.max_extent_m * (1 + 1e-9)


def box(folder: Path, name: str, *extents: float) -> MeasuredObject:
    path = folder / f"{name}.stl"
    trimesh.creation.box(extents).export(path)
    return measure_object(load_mesh_file(path, folder, path.name, CONFIG), CONFIG)


def plan(items: list[MeasuredObject], settled: Settled, config: ObjectsConfig = CONFIG) -> Plan:
    return plan_catalogue(items, frozenset(), (), (config, SplitConfig()), 0, settled)


def test_the_unit_is_decided_at_first_use_and_a_later_file_that_disagrees_is_named(
    tmp_path: Path,
) -> None:
    washer, part, plate = (
        box(tmp_path, "washer", 3.0, 2.0, 1.0),
        box(tmp_path, "part", 60.0, 40.0, 20.0),
        box(tmp_path, "plate", 90.0, 80.0, 20.0),
    )
    assert washer.source.unit == "m"  # alone
    first = plan([washer, part, plate], Settled("x"))
    assert {item.source.unit for item in first.taken} == {"mm"}
    np.testing.assert_allclose(first.measured["washer"].mesh.extents_m, [3e-3, 2e-3, 1e-3])
    assert first.figures["detected_unit"] == {"unit": "mm", "also_fit": ["cm"], "apart": {}}
    (remark,) = first.remarks
    assert "read in mm" in remark
    assert "objects.unit" in remark
    metres = [
        box(tmp_path, f"bottle_{number}", 0.1, 0.05 + 0.01 * number, 0.02) for number in range(5)
    ]
    second = plan([washer, part, plate, *metres], first.settled)
    assert second.measured["washer"].source.unit == "mm"
    assert second.figures["detected_unit"]["apart"] == {f"bottle_{k}.stl": "m" for k in range(5)}
    assert sum("does not fit the other meshes" in remark for remark in second.remarks) == 5
    # A folder of other files is asked anew.
    other = plan(metres, first.settled)
    assert other.figures["detected_unit"]["unit"] == "m"


def test_a_sheet_too_thin_in_the_folders_unit_is_left_out_by_name(tmp_path: Path) -> None:
    sheet = box(tmp_path, "sheet", 4.0, 4.0, 0.1)
    parts = [box(tmp_path, f"part_{k}", 60.0 + 20 * k, 40.0, 20.0) for k in range(2)]
    made = plan([sheet, *parts], Settled("x"))
    ((source, why),) = made.left_out
    assert source == "sheet.stl"
    assert "sheet.stl is too thin: 0.095 mm" in why.what


def test_what_declares_its_unit_takes_no_part(tmp_path: Path) -> None:
    trimesh.creation.box((3.0, 2.0, 1.0)).export(tmp_path / "large.glb")
    source = load_mesh_file(tmp_path / "large.glb", tmp_path, "large.glb", CONFIG)
    made = plan(
        [measure_object(source, CONFIG), box(tmp_path, "part", 60.0, 40.0, 20.0)], Settled("x")
    )
    assert made.measured["large"].source.unit == "m"
    assert made.measured["part"].source.unit == "mm"
    alone = plan([measure_object(source, CONFIG)], Settled("x"))
    assert alone.figures == {"detected_unit": {}}


def test_a_settled_unit_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "settled.json"
    settled = Settled("x").with_unit("mm", ["b", "a"], (0.002, 5.0))
    path.write_text(settled.to_json())
    assert read_settled(path, "x") == settled
    assert settled.unit_of(["a", "new"], (0.002, 5.0)) == "mm"
    assert settled.unit_of(["new"], (0.002, 5.0)) is None
    assert settled.unit_of(["a"], (0.001, 5.0)) is None
    path.write_text('{"basis": "x", "splits": {}, "unit": {"unit": "ell"}}')
    with pytest.raises(ConfigError, match="damaged"):
        read_settled(path, "x")
