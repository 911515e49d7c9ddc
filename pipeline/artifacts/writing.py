"""Writing an MCAP artifact of protobuf messages, with provenance first, published as a whole."""

from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Literal, Self

from google.protobuf.message import Message
from mcap.well_known import MessageEncoding
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema

from pipeline.artifacts.bounds import MOST_CHUNK_BYTES
from pipeline.artifacts.provenance import METADATA_NAME, Provenance
from pipeline.artifacts.publishing import published
from pipeline.errors import ArtifactError
from schemas.channels import DESCRIPTION, UNITS, channel_of

CHUNK_BYTES = 1 << 20  # a chunk is closed once it holds more
Compression = Literal["zstd", "lz4", "none"]
COMPRESSIONS = {
    "zstd": CompressionType.ZSTD,
    "lz4": CompressionType.LZ4,
    "none": CompressionType.NONE,
}


class ArtifactWriter:
    """Write one artifact; the file appears at ``path`` when the block ends well.

    >>> with ArtifactWriter(path, provenance) as artifact:
    ...     artifact.write("/objects", message, log_time_ns=0)
    """

    def __init__(
        self, path: Path, provenance: Provenance, compression: Compression = "zstd"
    ) -> None:
        self._path = path
        self._provenance = provenance
        self._compression = COMPRESSIONS[compression]
        self._channels: dict[str, tuple[int, str]] = {}
        self._schemas: dict[str, int] = {}
        self._described: dict[str, dict[str, str]] = {}

    def __enter__(self) -> Self:
        self._stack = ExitStack()
        scratch = self._stack.enter_context(published(self._path))
        self._file: BinaryIO = self._stack.enter_context(scratch.open("wb"))
        self._writer = Writer(
            self._file,
            chunk_size=CHUNK_BYTES,
            compression=self._compression,
            enable_data_crcs=True,
        )
        self._writer.start(profile="", library="softgrip")
        self._writer.add_metadata(METADATA_NAME, self._provenance.to_metadata())
        return self

    def describe(self, topic: str, description: str, units: str) -> None:
        """Say what a topic carries, before its first message; our own topics are known.

        Parameters
        ----------
        topic
            The topic.
        description
            What one message is.
        units
            Units of its numbers, and their frame where they have one.
        """
        self._described[topic] = {DESCRIPTION: description, UNITS: units}

    def write(self, topic: str, message: Message, log_time_ns: int) -> None:
        """Append a message.

        Parameters
        ----------
        topic
            Topic of one message type.
        message
            The message.
        log_time_ns
            Simulated time [ns], or the sample's index.

        Raises
        ------
        ArtifactError
            The topic already carries another message type, or the message is larger than readers
            accept.
        """
        name = message.DESCRIPTOR.full_name
        channel, carried = self._channels.get(topic, (0, name))
        if carried != name:
            raise ArtifactError(
                f"{self._path}: topic '{topic}' carries {carried} and cannot take a {name}",
                "Write it on a topic of its own",
            )
        # Without "deterministic", map fields may come out in another order on another run.
        data = message.SerializeToString(deterministic=True)
        if len(data) > MOST_CHUNK_BYTES - CHUNK_BYTES:
            raise ArtifactError(
                f"{self._path}: a {name} of {len(data)} bytes is more than a reader accepts",
                "Put less into one message",
            )
        if topic not in self._channels:
            if (known := channel_of(topic)) is not None:
                self._described.setdefault(topic, known.metadata())
            if name not in self._schemas:
                self._schemas[name] = register_schema(self._writer, type(message))
            channel = self._writer.register_channel(
                topic=topic,
                message_encoding=MessageEncoding.Protobuf,
                schema_id=self._schemas[name],
                metadata=self._described.get(topic, {}),
            )
            self._channels[topic] = (channel, name)
        self._writer.add_message(
            channel_id=channel,
            log_time=log_time_ns,
            publish_time=log_time_ns,
            data=data,
        )

    def end_chunk(self) -> None:
        """What is written next lies in another chunk: who reads the one does not read the other."""
        self._writer.flush()

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Add a named file, such as a checkpoint."""
        self._writer.add_attachment(
            create_time=0, log_time=0, name=name, media_type=media_type, data=data
        )

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is not None:
            self._stack.__exit__(kind, error, trace)
            return
        with self._stack:
            self._writer.finish()
