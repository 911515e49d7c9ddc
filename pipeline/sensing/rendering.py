"""Pictures of a scene: SAPIEN's renderer, or Embree rays where no Vulkan driver is."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Protocol

from loguru import logger

from pipeline.clutter.scene import ClutterScene
from pipeline.config.scenes import ScenesConfig
from pipeline.errors import MachineError
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.sensing.cameras import PinholeCamera
from pipeline.sensing.ray_rendering import ray_view
from pipeline.sensing.sapien_rendering import SapienRenderer


class SceneRenderer(Protocol):
    """Adds each camera's view to a scene."""

    name: str

    def rendered(self, scene: ClutterScene, objects: Mapping[str, CatalogueObject]) -> ClutterScene:
        """The same scene with its views."""
        ...


class RayRenderer:
    """Embree rays: pure pip, slower in colour, equal in depth."""

    name = "embree"

    def __init__(self, config: ScenesConfig, cameras: tuple[PinholeCamera, ...]) -> None:
        self._config = config
        self._cameras = cameras

    def rendered(self, scene: ClutterScene, objects: Mapping[str, CatalogueObject]) -> ClutterScene:
        """The same scene with its views."""
        views = tuple(
            ray_view(scene, objects, self._config.table_side_m, camera) for camera in self._cameras
        )
        return replace(scene, views=views)


def new_renderer(config: ScenesConfig, cameras: tuple[PinholeCamera, ...]) -> SceneRenderer:
    """SAPIEN's renderer where a driver is, Embree's with a notice where none is."""
    try:
        return SapienRenderer(config, cameras)
    except MachineError as error:
        logger.warning("rendering with Embree rays instead of SAPIEN: {}", error)
        return RayRenderer(config, cameras)
