"""What reading the corpus gives: each file and folder once, however many tests ask for it."""

import tempfile
from functools import cache
from pathlib import Path

from pipeline.config import ObjectsConfig
from pipeline.errors import MeshError
from pipeline.geometry.catalogue import MeasuredObject, measure_object
from pipeline.geometry.urdf_files import load_object_file
from tests.geometry.corpus.case import Case, write
from tests.geometry.corpus.folder_cases import FolderCase, Known, plan_of, write_folder

CONFIG = ObjectsConfig(rescaled=False)


@cache
def read(case: Case) -> MeasuredObject | MeshError:
    """The object of a file, or its refusal; the folder that it lay in is called FOLDER."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch).resolve()
        path = write(case, folder)
        try:
            return measure_object(load_object_file(path, folder, "object", CONFIG), CONFIG)
        except MeshError as error:
            told = (text.replace(str(folder), "FOLDER") for text in (error.what, error.remedy))
            return MeshError(*told)


@cache
def objects_of(case: FolderCase) -> dict[str, Known]:
    """What a run makes of a folder."""
    with tempfile.TemporaryDirectory() as scratch:
        plan = plan_of(write_folder(case, Path(scratch)))
    assert not plan.left_out, case.name
    return {
        item.source.name: Known(
            item.source.label, item.source.unit, plan.copies.get(item.source.name, ())
        )
        for item in plan.taken
    }
