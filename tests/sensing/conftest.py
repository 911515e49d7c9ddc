"""Bodies, their picture and a renderer, made once for all tests of the folder."""

from collections.abc import Mapping

import pytest
import trimesh

from pipeline.config import ScenesConfig
from pipeline.errors import MachineError
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.sensing.ray_rendering import RayRenderer
from pipeline.sensing.rendering import Renderer, render_views
from pipeline.sensing.sapien_rendering import SapienRenderer
from pipeline.world.view import CameraView
from tests.sensing.scenes import CAMERAS, CUBE_AND_BALL, made_object


@pytest.fixture(scope="package")
def objects(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, CatalogueObject]:
    """A cube, a ball and a glass ball, 100 mm each."""
    cache = tmp_path_factory.mktemp("parts")
    ball = trimesh.creation.icosphere(subdivisions=5)
    return {
        "cube": made_object("cube", trimesh.creation.box(), cache),
        "ball": made_object("ball", ball, cache),
        "glass ball": made_object("glass ball", ball, cache),
    }


@pytest.fixture(scope="package")
def view(objects: Mapping[str, CatalogueObject]) -> CameraView:
    """Cube and ball seen by rays."""
    renderer = RayRenderer(ScenesConfig())
    return render_views(CUBE_AND_BALL, objects, CAMERAS, renderer).views[0]


@pytest.fixture(scope="package")
def sapien_renderer() -> Renderer:
    try:
        return SapienRenderer(ScenesConfig())
    except MachineError as error:
        pytest.skip(f"no Vulkan driver: {error}")
