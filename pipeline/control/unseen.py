"""Contacts on objects that colour pictures show and depth images do not, such as transparent ones.

A depth camera measures what lies behind a transparent object (Supplement VIII, first failure). With
a segmentation of the colour pictures, an instance whose pixels were measured no higher than the
table is such an object. Its outlines from several viewpoints bound it: the visual hull (Laurentini,
1994), all places that every picture shows within the outline. The hull gives the object's
horizontal place well, and its height only as an upper bound: the pad goes down until it touches.
"""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Integer

from pipeline.config.policy import UnseenConfig
from pipeline.control.cloud import DepthPicture
from pipeline.world.cameras import in_picture, pixel_rays, points_of_depth, project

TABLE = 0  # instance of the table and of nothing


def unseen_contacts(
    pictures: Sequence[DepthPicture], config: UnseenConfig, above_table_m: float
) -> list[Float[np.ndarray, "4 4"]]:
    """Find a contact on top of each object that the depth images do not show.

    Parameters
    ----------
    pictures
        Pictures of one scene; those without a segmentation are not used.
    config
        Shares, and size and cells of the visual hull.
    above_table_m
        Points above this height in WCS count as measured on an object [m].

    Returns
    -------
    world_from_contact of each object, level, shape (4, 4).
    """
    segmented = [picture for picture in pictures if picture.instances is not None]
    unseen = unseen_instances(segmented, config, above_table_m)
    found = (hull_top(segmented, name, config) for name in unseen)
    return [contact for contact in found if contact is not None]


def unseen_instances(
    pictures: Sequence[DepthPicture], config: UnseenConfig, above_table_m: float
) -> list[int]:
    """Instances of which too small a share of pixels, over all pictures, lies above the table."""
    shown: Counter[int] = Counter()
    above: Counter[int] = Counter()
    for picture in pictures:
        instances = _instances(picture)
        points, rows, columns = points_of_depth(picture.depth_m, picture.camera, every=1)
        high = points[:, 2] > above_table_m
        shown.update(instances.ravel().tolist())
        above.update(instances[rows[high], columns[high]].tolist())
    return [
        name
        for name, count in sorted(shown.items())
        if name != TABLE
        and count >= config.fewest_pixels
        and above[name] < config.measured_share * count
    ]


def hull_top(
    pictures: Sequence[DepthPicture], name: int, config: UnseenConfig
) -> Float[np.ndarray, "4 4"] | None:
    """Find a level contact on top of the middle of an instance's visual hull.

    A place counts as inside the hull also where a picture does not show it, because it lies outside
    the picture or behind another object.

    Parameters
    ----------
    pictures
        Pictures with a segmentation.
    name
        The instance.
    config
        Size and cells of the grid of places.

    Returns
    -------
    world_from_contact, shape (4, 4); None where no picture shows the instance or the hull is empty.
    """
    outlines = [(picture, _instances(picture) == name) for picture in pictures]
    outlines = [(picture, mask) for picture, mask in outlines if mask.any()]
    if not outlines:
        return None
    places = _places(*outlines[0], config)
    within = np.ones(len(places), dtype=bool)
    for picture, mask in outlines:
        within &= _within(picture, mask, places)
    hull = places[within]
    if len(hull) == 0:
        return None
    contact = np.eye(4)
    contact[:3, 3] = [*hull[:, :2].mean(axis=0), hull[:, 2].max()]
    return contact


def _places(
    picture: DepthPicture, mask: Bool[np.ndarray, "h w"], config: UnseenConfig
) -> Float[np.ndarray, "n 3"]:
    """Grid of places where the object may be [m]: over its outline on the table and around that."""
    eye, rays = pixel_rays(picture.camera, mask)
    down = rays[:, 2] < 0
    if not down.any():
        return np.empty((0, 3))
    on_table = eye[:2] - rays[down, :2] * (eye[2] / rays[down, 2])[:, None]
    middle = np.median(on_table, axis=0)
    low = np.maximum(on_table.min(axis=0) - config.around_m, middle - config.extent_max_m / 2)
    high = np.minimum(on_table.max(axis=0) + config.around_m, middle + config.extent_max_m / 2)
    axes = [np.arange(low[axis], high[axis], config.cell_m) for axis in range(2)]
    heights = np.arange(config.cell_m / 2, config.height_max_m, config.cell_m)
    return np.stack(np.meshgrid(*axes, heights, indexing="ij"), axis=-1).reshape(-1, 3)


def _within(
    picture: DepthPicture, mask: Bool[np.ndarray, "h w"], places_m: Float[np.ndarray, "n 3"]
) -> Bool[np.ndarray, " n"]:
    """Whether each place is within the outline in a picture, or is not visible in it."""
    pixels, z = project(picture.camera, places_m)
    shown = in_picture(picture.camera, pixels)
    column, row = np.floor(pixels[shown]).astype(np.int64).T
    inside = ~shown
    depth = picture.depth_m[row, column]
    hidden = (_instances(picture)[row, column] != TABLE) & (depth > 0) & (depth < z[shown])
    inside[shown] = mask[row, column] | hidden
    return np.asarray(inside)


def _instances(picture: DepthPicture) -> Integer[np.ndarray, "h w"]:
    assert picture.instances is not None
    return picture.instances
