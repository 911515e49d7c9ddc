"""Where an artifact comes from: the metadata record every file carries."""

import hashlib
import json
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Self

from pipeline.errors import ArtifactError

METADATA_NAME = "provenance"
# The part after the dot rises where earlier programs cannot follow: since 1.1 clouds lie apart.
SCHEMA_VERSION = "softgrip.v1.1"
READ_VERSIONS = ("softgrip.v1", SCHEMA_VERSION)
DIGEST = "record_sha256"  # MCAP has no checksum of a metadata record


@dataclass(frozen=True)
class Input:
    """A file a stage read: its name within the run (or mesh folder) and its content."""

    path: str
    sha256: str


@dataclass(frozen=True)
class Provenance:
    """What made a file. Equal provenance means equal bytes.

    Attributes
    ----------
    stage
        Name of the stage.
    key
        Digest over configuration, code, machine and inputs; a file is fresh while this is
        unchanged.
    config_digest
        SHA-256 over the configuration that the stage reads.
    code_digest
        SHA-256 over the code that the stage runs.
    seed
        The run's seed.
    inputs
        Files that the stage read, with their digests.
    package_version
        Version of softgrip.
    schema_version
        Version of the message schemas that wrote the file.
    key_parts
        What ``key`` is computed over, as JSON; empty in files that do not record it.
    """

    stage: str
    key: str
    config_digest: str
    code_digest: str
    seed: int
    inputs: tuple[Input, ...]
    package_version: str
    schema_version: str = SCHEMA_VERSION
    key_parts: str = ""

    @property
    def machine(self) -> dict[str, str]:
        """Python, renderer and packages that it was made with; empty where the file tells none."""
        return dict(json.loads(self.key_parts)["machine"]) if self.key_parts else {}

    def to_metadata(self) -> dict[str, str]:
        """The record as MCAP metadata (strings only); without ``key_parts`` where it has none."""
        fields = asdict(self)
        if not self.key_parts:
            del fields["key_parts"]
        fields["inputs"] = json.dumps(fields["inputs"], sort_keys=True)
        record = {name: str(value) for name, value in fields.items()}
        return {**record, DIGEST: _digest(record)}

    @classmethod
    def from_metadata(cls, metadata: dict[str, str]) -> Self:
        """Read the record back.

        Parameters
        ----------
        metadata
            The record as MCAP metadata, as `to_metadata` gives it.

        Returns
        -------
        The record.

        Raises
        ------
        ArtifactError
            Fields are missing or damaged, or another major schema version wrote it.
        """
        written = metadata.get("schema_version", "none")
        if written not in READ_VERSIONS:
            raise ArtifactError(
                f"Written with schema version {written}, this softgrip reads "
                f"{' and '.join(READ_VERSIONS)}",
                "Use the softgrip version that wrote it, or make the file again",
            )
        # Early files have none, and a flipped bit that hides it leaves the other fields whole.
        if DIGEST in metadata and metadata[DIGEST] != _digest(metadata):
            raise ArtifactError(
                "The provenance record is damaged: it does not match its own SHA-256",
                "Delete the file and run the same command again",
            )
        try:
            inputs = tuple(Input(**entry) for entry in json.loads(metadata["inputs"]))
            made = cls(
                stage=metadata["stage"],
                key=metadata["key"],
                config_digest=metadata["config_digest"],
                code_digest=metadata["code_digest"],
                seed=int(metadata["seed"]),
                inputs=inputs,
                package_version=metadata["package_version"],
                schema_version=written,
                key_parts=metadata.get("key_parts", ""),
            )
            _ = made.machine  # it can be read
        except (KeyError, TypeError, ValueError) as error:
            raise ArtifactError(
                f"The provenance record cannot be read ({error!r})",
                "The file is damaged: make it again",
            ) from error
        return made


def _digest(record: dict[str, str]) -> str:
    """SHA-256 over all other fields of a record."""
    fields = {name: value for name, value in record.items() if name != DIGEST}
    return hashlib.sha256(json.dumps(fields, sort_keys=True).encode()).hexdigest()


def package_version() -> str:
    """The installed softgrip version; 'source' when run from a bare checkout."""
    try:
        return version("softgrip")
    except PackageNotFoundError:
        return "source"
