"""A provenance record for files made in tests."""

import pytest

from pipeline.artifacts import Input, Provenance


@pytest.fixture
def provenance() -> Provenance:
    """A record with two inputs."""
    return Provenance(
        stage="objects",
        key="k",
        config_digest="c",
        code_digest="d",
        seed=7,
        inputs=(Input("meshes/a.ply", "00"), Input("scenes.mcap", "11")),
        package_version="0.1.0",
    )
