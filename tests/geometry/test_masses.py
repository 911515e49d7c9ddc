"""Masses by name, and densities that are drawn where none is known."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from pipeline.config.objects import ObjectsConfig
from pipeline.errors import ConfigError
from pipeline.geometry.masses import density_of, mass_of, read_masses
from tests.bodies import mesh_of

YCB = Path(__file__).parents[2] / "runs" / "paper" / "masses.toml"


def test_the_first_name_that_fits_gives_the_mass(tmp_path: Path) -> None:
    path = tmp_path / "masses.toml"
    path.write_text('"can" = 0.4\n"box-*" = 1\n"*" = 2.5\n')
    masses = read_masses(path)
    assert [mass_of(name, masses) for name in ("can", "box-3", "ball")] == [0.4, 1.0, 2.5]
    assert mass_of("can", {}) is None


@pytest.mark.parametrize("text", ["can = 0", "can = true", "can = 'heavy'", "can = nan", "can = "])
def test_what_is_no_mass_is_refused_by_name(tmp_path: Path, text: str) -> None:
    path = tmp_path / "masses.toml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=r"masses\.toml"):
        read_masses(path)


@given(st.floats(1, 10), st.integers(0, 2**32))
def test_an_unknown_density_is_drawn_within_the_spread(spread: float, seed: int) -> None:
    config = ObjectsConfig(density_spread=spread)
    box = mesh_of(trimesh.creation.box((0.1, 0.1, 0.1)))
    drawn = density_of(box, None, config, np.random.default_rng(seed))
    assert 300 / spread <= drawn * (1 + 1e-9)
    assert drawn <= 300 * spread * (1 + 1e-9)
    assert density_of(box, 0.3, config, np.random.default_rng(seed)) == pytest.approx(300)


def test_the_published_masses_are_of_household_things() -> None:
    masses = read_masses(YCB)
    assert masses["002_master_chef_can"] == 0.414
    assert all(0.005 < mass < 1.1 for mass in masses.values())
