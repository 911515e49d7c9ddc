"""Pictures of a scene (S-1.14): SAPIEN's renderer, or Embree rays where no Vulkan driver is.

On one machine and driver equal scenes give equal bits. Between drivers the last bits of depth
differ, and at silhouettes the body a pixel belongs to: so renderers are compared inside
surfaces alone, on depth, segmentation and normals within bounds (tests/sensing/test_rendering).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from jaxtyping import UInt8
from loguru import logger

from pipeline.config.cameras import RendererName
from pipeline.config.scenes import ScenesConfig
from pipeline.errors import MachineError
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.sensing.ray_rendering import RayRenderer
from pipeline.sensing.sapien_rendering import SapienRenderer
from pipeline.world.cameras import PinholeCamera
from pipeline.world.scene import ClutterScene, PlacedObject
from pipeline.world.view import CameraView

# What of a transparent object's own colour is seen, the rest being what lies behind it.
_TINT = 0.25


class Renderer(Protocol):
    """Draws objects on the table as each camera sees them, all of them opaque."""

    name: str

    def views(
        self,
        placed: Sequence[PlacedObject],
        objects: Mapping[str, CatalogueObject],
        cameras: Sequence[PinholeCamera],
    ) -> tuple[CameraView, ...]:
        """One exact view a camera."""
        ...


def new_renderer(name: RendererName, config: ScenesConfig) -> Renderer:
    """The renderer asked for; ``auto`` is SAPIEN's, and Embree's with a notice without a driver.

    Parameters
    ----------
    name
        ``auto``, ``sapien`` or ``embree``.
    config
        Section scenes: the table that is rendered.

    Returns
    -------
    A renderer, ready.

    Raises
    ------
    MachineError : SAPIEN's was asked for by name and no Vulkan driver can render.
    """
    if name == "embree":
        return RayRenderer(config)
    try:
        return SapienRenderer(config)
    except MachineError as error:
        if name == "sapien":
            raise
        logger.warning("rendering with Embree rays instead of SAPIEN: {}", error)
        return RayRenderer(config)


def render_views(
    scene: ClutterScene,
    objects: Mapping[str, CatalogueObject],
    cameras: Sequence[PinholeCamera],
    renderer: Renderer,
) -> ClutterScene:
    """Render a scene with each camera; transparent objects let the view behind them through.

    Parameters
    ----------
    scene
        The scene.
    objects
        Catalogue entry of each object by its name.
    cameras
        The cameras.
    renderer
        SAPIEN's or Embree's.

    Returns
    -------
    The same scene with one view for each camera.
    """
    views = renderer.views(scene.objects, objects, cameras)
    opaque = [p for p in scene.objects if objects[p.object_name].material == "opaque"]
    if len(opaque) < len(scene.objects):
        behind = renderer.views(opaque, objects, cameras)
        views = tuple(_seen_through(*pair) for pair in zip(views, behind, strict=True))
    return replace(scene, views=views)


def _seen_through(view: CameraView, behind: CameraView) -> CameraView:
    """A view whose transparent objects let the view behind them through."""
    return replace(view, colour=_blended(view, behind), behind_m=behind.depth_m)


def _blended(view: CameraView, behind: CameraView) -> UInt8[np.ndarray, "h w 3"]:
    mixed = _TINT * view.colour.astype(np.float64) + (1.0 - _TINT) * behind.colour
    through = view.depth_m != behind.depth_m
    return np.where(through[..., None], np.round(mixed), view.colour).astype(np.uint8)
