"""Reading an MCAP artifact: checked, versioned, and refused in words when damaged."""

import io
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import zstandard
from google.protobuf.message import DecodeError, Message
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Attachment, Statistics
from mcap.summary import Summary

from pipeline.artifacts.bounds import (
    BoundedFile,
    check_chunk,
    check_data,
    check_index,
    read_attachment_record,
)
from pipeline.artifacts.provenance import METADATA_NAME, Provenance
from pipeline.errors import ArtifactError, ContentError

M = TypeVar("M", bound=Message)

# What a reader of damaged bytes can raise; anything else is a bug of ours.
DAMAGE = (
    McapError,
    DecodeError,
    zstandard.ZstdError,
    struct.error,
    UnicodeDecodeError,
    EOFError,
    ValueError,
    KeyError,
    AssertionError,
    RuntimeError,
    MemoryError,
    OverflowError,
    IndexError,
)


class Artifact:
    """One open MCAP artifact."""

    def __init__(self, file: BoundedFile) -> None:
        self.path = file.path
        self._file = file
        with _named(self.path):
            check_index(file)
            self._reader = make_reader(file, validate_crcs=True)
            self._summary, self._statistics = _index_of(file, self._reader.get_summary())
        self._checked_chunks: set[int] = set()
        self.provenance = self._read_provenance()

    def messages(
        self, kind: type[M], topic: str | None = None, at_ns: int | None = None
    ) -> Iterator[tuple[int, M]]:
        """Read every message of a type, in log-time order.

        Parameters
        ----------
        kind
            Class of the messages.
        topic
            Read this topic alone; None: all topics that carry the type.
        at_ns
            Read messages of this log time alone [ns]; None: all.

        Yields
        ------
        tuple[int, M]
            Log time [ns] and message.

        Raises
        ------
        ArtifactError
            A topic carries another version of the type, or bytes are damaged.
        """
        wanted = kind.DESCRIPTOR.full_name
        topics = self._topics_of(wanted) if topic is None else [topic]
        if not topics:
            return
        with _named(self.path):
            self._check_chunks(set(topics), at_ns)
            for schema, channel, message in self._reader.iter_messages(
                topics=topics,
                starting_at=at_ns,
                ending_before=None if at_ns is None else at_ns + 1,
            ):
                if schema is None or schema.name != wanted:
                    carried = "no schema" if schema is None else schema.name
                    raise ArtifactError(
                        f"{self.path}: topic '{channel.topic}' carries {carried}, "
                        f"this softgrip reads {wanted}",
                        "Make the file again with this version",
                    )
                yield message.log_time, kind.FromString(message.data)

    def one(self, kind: type[M]) -> M:
        """The only message of a type."""
        found = [message for _, message in self.messages(kind)]
        if len(found) != 1:
            raise ArtifactError(
                f"{self.path} holds {len(found)} {kind.DESCRIPTOR.full_name}, expected one",
                "Make the file again",
            )
        return found[0]

    def attachment(self, name: str) -> bytes:
        """The bytes attached under a name."""
        with _named(self.path):
            for index in self._summary.attachment_indexes:
                if index.name == name:
                    record = io.BytesIO(read_attachment_record(self._file, index))
                    return bytes(Attachment.read(ReadDataStream(record)).data)
        raise ArtifactError(f"{self.path} has no attachment '{name}'", "Make the file again")

    def attachment_sizes(self) -> dict[str, int]:
        """Name → bytes of every attachment."""
        return {index.name: index.data_size for index in self._summary.attachment_indexes}

    def counts(self) -> dict[str, tuple[str, int]]:
        """Topic → (schema name, messages)."""
        counts = self._statistics.channel_message_counts
        with _named(self.path):
            return {
                channel.topic: (
                    self._summary.schemas[channel.schema_id].name,
                    counts.get(channel.id, 0),
                )
                for channel in self._summary.channels.values()
            }

    def check(self) -> None:
        """Hold every byte of the file against its checksums; reads all of it.

        Raises
        ------
        ArtifactError
            Something is damaged.
        """
        with _named(self.path):
            check_data(self._file)

    def _check_chunks(self, topics: set[str], at_ns: int | None) -> None:
        """Refuse chunks that declare what must not be allocated, before they are read."""
        channels = {number for number, ch in self._summary.channels.items() if ch.topic in topics}
        for index in self._summary.chunk_indexes:
            start, held = index.chunk_start_offset, index.message_index_offsets
            wanted = at_ns is None or index.message_start_time <= at_ns <= index.message_end_time
            wanted = wanted and (not held or not channels.isdisjoint(held))
            if wanted and start not in self._checked_chunks:
                check_chunk(self._file, index)
                self._checked_chunks.add(start)

    def _topics_of(self, schema_name: str) -> list[str]:
        base, _, short = schema_name.rpartition(".")
        found = []
        for topic, (carried, _) in self.counts().items():
            carried_base, _, carried_short = carried.rpartition(".")
            if carried == schema_name:
                found.append(topic)
            elif carried_short == short and carried_base.split(".")[0] == base.split(".")[0]:
                raise ArtifactError(
                    f"{self.path} was written with {carried}, this softgrip reads {schema_name}",
                    "Use the softgrip version that wrote it, or make the file again",
                )
        return found

    def _read_provenance(self) -> Provenance:
        with _named(self.path):
            for metadata in self._reader.iter_metadata():
                if metadata.name == METADATA_NAME:
                    return Provenance.from_metadata(metadata.metadata)
        raise ArtifactError(
            f"{self.path} carries no provenance", "It is not a softgrip artifact: make it again"
        )


@contextmanager
def open_artifact(path: Path) -> Iterator[Artifact]:
    """Open an artifact for reading; every checksum is compared.

    Parameters
    ----------
    path
        The file.

    Yields
    ------
    Artifact
        The open artifact.

    Raises
    ------
    ArtifactError
        Missing, not an MCAP, damaged, or of another version; also where the caller finds that its
        messages cannot be used (`ContentError`).
    """
    try:
        file = BoundedFile(path)
    except FileNotFoundError as error:
        raise ArtifactError(
            f"{path} does not exist", "Run the stage that makes it (see 'make help')"
        ) from error
    except OSError as error:
        raise ArtifactError(
            f"{path} cannot be read: {error.strerror}", "Mend its access"
        ) from error
    with file:
        artifact = Artifact(file)
        try:
            yield artifact
        except ContentError as error:
            raise ArtifactError(f"{path}: {error.what}", error.remedy) from error


def read_provenance(path: Path) -> Provenance:
    """The provenance record of a file."""
    with open_artifact(path) as artifact:
        return artifact.provenance


def _index_of(file: BoundedFile, summary: Summary | None) -> tuple[Summary, Statistics]:
    """The index with its counts; without it the library would read on, checking nothing."""
    if summary is None or summary.statistics is None:
        raise file.damaged("it has no index")
    if summary.statistics.message_count and not summary.chunk_indexes:
        raise file.damaged("its index names no chunk, and it holds messages")
    return summary, summary.statistics


@contextmanager
def _named(path: Path) -> Iterator[Any]:
    """Damage found while reading, as one sentence that names the file."""
    try:
        yield
    except ArtifactError as error:
        if str(path) in error.what:
            raise
        raise ArtifactError(f"{path}: {error.what}", error.remedy) from error
    except DAMAGE as error:
        raise ArtifactError(
            f"{path} is damaged ({type(error).__name__}: {error})",
            "Delete it and run the same command again",
        ) from error
