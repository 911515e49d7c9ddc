"""Troublesome files by a script that others wrote, held against the answers it leaves beside them.

``CASES_DIR`` names the folder of the script ``write_cases.py``.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.config import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.catalogue import measure_object
from pipeline.geometry.shape import surface_area, volume
from pipeline.geometry.urdf_files import load_object_file
from tests.geometry.corpus.folder_cases import plan_of

NAMED = os.environ.get("CASES_DIR", "")
RELATIVE = 1e-5  # files hold nine digits, or a float32


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, dict[str, Any]]]:
    """The folder of files, and what is right for each."""
    script = Path(NAMED) / "write_cases.py"
    if not NAMED or not script.is_file():
        pytest.skip("CASES_DIR names no folder with write_cases.py")
    folder = tmp_path_factory.mktemp("cases")
    subprocess.run([sys.executable, str(script), str(folder)], check=True, capture_output=True)
    return folder, json.loads((folder / "answers.json").read_text())


def test_every_file_is_read_right_or_refused(
    written: tuple[Path, dict[str, dict[str, Any]]],
) -> None:
    folder, answers = written
    config = ObjectsConfig(unit="m", rescaled=False)
    wrong = {}
    for name, right in answers.items():
        path = folder / name
        if not path.is_file():
            continue  # a folder of copies: below
        try:
            item = measure_object(load_object_file(path, folder, "o", config), config)
        except MeshError as error:
            if "refuse" not in right:
                wrong[name] = str(error)
            continue
        found = {
            "volume": volume(item.mesh),
            "area": surface_area(item.mesh),
            "nsvr": item.nsvr,
            "extents": np.ptp(item.mesh.vertices_m, axis=0),
        }
        if "refuse" in right:
            wrong[name] = "taken"
        for key in found.keys() & right.keys():
            if not np.allclose(found[key], right[key], rtol=RELATIVE):
                wrong[name] = f"{key} is {found[key]}, and {right[key]} is right"
    assert wrong == {}


def test_a_folder_of_copies_is_as_many_objects_as_it_holds(
    written: tuple[Path, dict[str, dict[str, Any]]],
) -> None:
    folder, answers = written
    held = {name: right["objects"] for name, right in answers.items() if "objects" in right}
    assert held
    for name, objects in held.items():
        plan = plan_of(folder / name)
        assert len(plan.taken) == objects
        files = {item.source.label for item in plan.taken}.union(*plan.copies.values())
        assert len(files) == sum(path.is_file() for path in (folder / name).rglob("*"))
