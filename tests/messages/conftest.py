"""A provenance to write test files with."""

from tests.artifacts.conftest import provenance

__all__ = ["provenance"]
