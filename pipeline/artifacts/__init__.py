"""MCAP files: reading and writing, versions, provenance, publishing a file whole or not at all."""

from pipeline.artifacts.provenance import Input, Provenance, package_version
from pipeline.artifacts.publishing import file_sha256, publish_bytes, published
from pipeline.artifacts.reading import Artifact, open_artifact, read_provenance
from pipeline.artifacts.tensors import from_tensor, to_tensor
from pipeline.artifacts.writing import ArtifactWriter

__all__ = [
    "Artifact",
    "ArtifactWriter",
    "Input",
    "Provenance",
    "file_sha256",
    "from_tensor",
    "open_artifact",
    "package_version",
    "publish_bytes",
    "published",
    "read_provenance",
    "to_tensor",
]
