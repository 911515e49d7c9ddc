"""Stretched copies: other shapes whose physics is that of the mesh they have."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from pipeline.config import ObjectsConfig
from pipeline.geometry.catalogue import CatalogueObject, prepare_object, stretched_copy
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.parametric import parametric_source
from pipeline.geometry.rescaling import draw_stretch
from pipeline.geometry.shape import nsvr, shape_class

CONFIG = ObjectsConfig(convex={"input_faces": 200})


@pytest.fixture(scope="module")
def mug(tmp_path_factory: pytest.TempPathFactory) -> CatalogueObject:
    cache: Path = tmp_path_factory.mktemp("convex_parts")
    return prepare_object(parametric_source("mug"), CONFIG, np.random.default_rng(0), cache)


@given(seed=st.integers(0, 2**32 - 1), most=st.floats(1.0, 4.0))
def test_factors_stretch_no_axis_over_another_more_than_allowed(seed: int, most: float) -> None:
    config = CONFIG.model_copy(update={"stretch_max": most})
    factors = draw_stretch(config, np.random.default_rng(seed))
    assert factors.max() / factors.min() <= most * (1 + 1e-9)
    assert_allclose(factors.prod(), 1.0, rtol=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_a_copy_is_what_the_source_stretched_would_be(mug: CatalogueObject, seed: int) -> None:
    copy = stretched_copy(mug, "other", CONFIG, np.random.default_rng(seed))
    surface = trimesh.Trimesh(copy.mesh.vertices_m, copy.mesh.faces, process=False)
    assert copy.name == "other"
    assert surface.is_watertight
    assert_allclose(surface.extents.max(), copy.target_extent_m)
    assert CONFIG.target_extent_min_m <= copy.target_extent_m <= CONFIG.target_extent_max_m
    source = mug.mesh.vertices_m / mug.scale
    assert_allclose(copy.mesh.vertices_m, copy.scale * copy.stretch * source)
    assert copy.nsvr == pytest.approx(nsvr(copy.mesh))
    assert copy.nsvr != pytest.approx(mug.nsvr, rel=1e-3)
    assert copy.shape_class == shape_class(copy.nsvr)
    assert_allclose(copy.centre_of_mass_m, 0.0, atol=1e-9)
    surface.density = mug.density_kg_m3
    assert copy.mass_kg == pytest.approx(surface.mass)
    assert_allclose(copy.inertia_kg_m2, surface.moment_inertia, atol=1e-9)


def test_its_convex_parts_stay_convex_and_cover_it_as_well(mug: CatalogueObject) -> None:
    copy = stretched_copy(mug, "other", CONFIG, np.random.default_rng(1))
    assert len(copy.convex_parts) == len(mug.convex_parts)
    for part in copy.convex_parts:
        solid = trimesh.Trimesh(part.vertices_m, part.faces, process=False)
        assert solid.volume == pytest.approx(solid.convex_hull.volume, rel=1e-6)
    most = copy.scale / mug.scale * copy.stretch.max()
    assert _uncovered_m(copy) <= most * _uncovered_m(mug) + 1e-9


def _uncovered_m(item: CatalogueObject) -> float:
    """How far a vertex lies outside of all parts, at most."""
    return float(
        np.min([_beyond(p, item.mesh.vertices_m) for p in item.convex_parts], axis=0).max()
    )


def _beyond(part: Mesh, points_m: np.ndarray) -> np.ndarray:
    """Distance beyond the farthest face plane of a convex part; below 0 inside."""
    solid = trimesh.Trimesh(part.vertices_m, part.faces, process=False)
    offset = np.einsum("fk,fk->f", solid.triangles_center, solid.face_normals)
    return np.asarray((points_m @ solid.face_normals.T - offset).max(axis=1))


def test_own_sizes_are_kept_where_nothing_is_rescaled(mug: CatalogueObject) -> None:
    config = CONFIG.model_copy(update={"rescaled": False})
    copy = stretched_copy(mug, "other", config, np.random.default_rng(1))
    assert copy.scale == pytest.approx(mug.scale)
    assert copy.volume_m3 == pytest.approx(mug.volume_m3)
