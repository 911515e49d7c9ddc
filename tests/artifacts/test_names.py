"""No name in a message leads out of a folder."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.artifacts import ArtifactWriter, Provenance, to_tensor
from pipeline.artifacts.names import file_name
from pipeline.errors import ArtifactError
from pipeline.geometry.parametric import PARAMETRIC_OBJECTS
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scene
from schemas.softgrip.v1.objects_pb2 import CatalogueObject
from schemas.softgrip.v1.scenes_pb2 import Scene


@pytest.mark.parametrize("name", ["../evil", "/etc/evil", "a/b", "..", "", "a\0b", "x" * 300])
def test_a_name_that_leads_out_of_a_folder_is_refused(
    tmp_path: Path, provenance: Provenance, name: str
) -> None:
    """Objects and scenes give their names to files: of exports, of pieces of a stage."""
    objects, scenes = tmp_path / "objects.mcap", tmp_path / "scenes.mcap"
    with ArtifactWriter(objects, provenance) as artifact:
        item = CatalogueObject(name=name, shape_class="basic")
        artifact.write("/objects", item, log_time_ns=0)
    with ArtifactWriter(scenes, provenance) as artifact:
        scene = Scene(scene_id=name, contacts=to_tensor(np.zeros((0, 2), dtype=np.uint32)))
        artifact.write("/scenes", scene, log_time_ns=0)
    with pytest.raises(ArtifactError, match=r"objects\.mcap: .* is no name of an object"):
        read_objects(objects)
    with pytest.raises(ArtifactError, match=r"scenes\.mcap: .* is no name of an object or a scene"):
        read_scene(scenes, 0)


def test_embedded_objects_have_names_for_files() -> None:
    assert [file_name(name) for name in PARAMETRIC_OBJECTS] == list(PARAMETRIC_OBJECTS)
