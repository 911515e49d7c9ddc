"""Checks of the sizes and checksums that an MCAP file declares, before they are trusted.

The library's reader allocates what a record declares, and it checks the checksums of chunks alone.
Here a declared size is refused before it is allocated, and the index section, an attachment and the
data section as a whole are compared with their checksums.
"""

import io
import struct
import zlib
from pathlib import Path

import lz4.frame
import zstandard
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, ChunkIndex

from pipeline.errors import ArtifactError

MOST_CHUNK_BYTES = 256 * 2**20  # uncompressed; a writer refuses larger messages

MAGIC = b"\x89MCAP0\r\n"
FOOTER = struct.Struct("<BQQQI")  # opcode, length, summary start, offset start, CRC
DATA_END = struct.Struct("<BQI")  # opcode, length, CRC
CHUNK_HEAD = struct.Struct("<BQQQQII")  # opcode, length, times, size, CRC, length of the next name
RECORD_HEAD_BYTES = 9  # MCAP: a byte of kind, eight of length
CRC_BYTES = 4  # MCAP writes CRC-32 everywhere
FRAME_HEAD_BYTES = 32  # more than the header of a zstd or lz4 frame
SMALL_READ_BYTES = 1 << 16  # holds an MCAP summary of our files whole
BLOCK_BYTES = 1 << 20  # read at once: bounds the memory of a check

REMEDY = "Delete it and run the same command again"


class BoundedFile(io.BufferedReader):
    """A file that refuses a read beyond its end instead of allocating memory for it."""

    def __init__(self, path: Path) -> None:
        super().__init__(io.FileIO(path))
        self.path = path
        self.size = path.stat().st_size

    def read(self, size: int | None = -1, /) -> bytes:
        """Read bytes from the current position.

        Parameters
        ----------
        size
            Bytes to read; None or -1: all that are left.

        Returns
        -------
        The bytes; fewer than ``size`` at the end of the file.

        Raises
        ------
        ArtifactError
            More than ``SMALL_READ_BYTES`` are asked for and the file does not hold them.
        """
        if size is not None and size > SMALL_READ_BYTES and size > self.size - self.tell():
            raise self.damaged(f"it declares {size} bytes where {self.size - self.tell()} are left")
        return super().read(size)

    def seek(self, target: int, whence: int = io.SEEK_SET, /) -> int:
        """Move the position.

        Parameters
        ----------
        target
            Offset in bytes.
        whence
            What the offset counts from, as for any file.

        Returns
        -------
        The new position, in bytes from the start.

        Raises
        ------
        ArtifactError
            The place, counted from the start, lies outside the file.
        """
        if whence == io.SEEK_SET and not 0 <= target <= self.size:
            raise self.damaged(f"it points to byte {target} of {self.size}")
        return super().seek(target, whence)

    def read_at(self, offset: int, size: int) -> bytes:
        """Exactly ``size`` bytes from ``offset``."""
        if not 0 <= offset <= self.size - size:
            raise self.damaged(f"it points to bytes {offset} to {offset + size} of {self.size}")
        self.seek(offset)
        return self.read(size)

    def damaged(self, reason: str) -> ArtifactError:
        """The error that names this file."""
        return ArtifactError(f"{self.path} is damaged ({reason})", REMEDY)


def check_index(file: BoundedFile) -> int:
    """Compare the index (summary) section with its checksum.

    Parameters
    ----------
    file
        The file; its position is at the start afterwards.

    Returns
    -------
    Where the section starts, in bytes from the start of the file.

    Raises
    ------
    ArtifactError
        The file is no MCAP, is cut short, or its index fails its checksum.
    """
    start, footer_at, stored = _footer(file)
    index = file.read_at(start, footer_at - start + FOOTER.size - CRC_BYTES)
    if zlib.crc32(index) != stored:
        raise file.damaged("its index does not match its checksum")
    file.seek(0)
    return start


def check_data(file: BoundedFile) -> None:
    """Compare the data section with its checksum; reads the whole file.

    Parameters
    ----------
    file
        The file.

    Raises
    ------
    ArtifactError
        They do not match.
    """
    end = check_index(file) - DATA_END.size
    opcode, length, stored = DATA_END.unpack(file.read_at(end, DATA_END.size))
    if opcode != Opcode.DATA_END or length != CRC_BYTES or stored == 0:
        raise file.damaged("its data section has no checksum")
    file.seek(0)
    found, left = 0, end
    while left > 0:
        block = file.read(min(left, BLOCK_BYTES))
        found, left = zlib.crc32(block, found), left - len(block)
    if found != stored:
        raise file.damaged("its data section does not match its checksum")


def check_chunk(file: BoundedFile, index: ChunkIndex) -> None:
    """Compare what a chunk declares with the file and with the largest chunk allowed.

    Parameters
    ----------
    file
        The file.
    index
        The chunk's entry in the file's index.

    Raises
    ------
    ArtifactError
        It would decompress to more than ``MOST_CHUNK_BYTES``, or contradicts itself.
    """
    head = file.read_at(index.chunk_start_offset, CHUNK_HEAD.size)
    opcode, length, _, _, declared, _, name_bytes = CHUNK_HEAD.unpack(head)
    if opcode != Opcode.CHUNK or length > file.size or name_bytes > length:
        raise file.damaged("its index points to no chunk")
    if declared > MOST_CHUNK_BYTES:
        raise file.damaged(
            f"a chunk declares {declared} bytes, more than the {MOST_CHUNK_BYTES} allowed"
        )
    compression = file.read(name_bytes).decode()
    (stored,) = struct.unpack("<Q", file.read(8))
    if stored > length:
        raise file.damaged("a chunk declares more than its record holds")
    found = _content_bytes(compression, file.read(min(stored, FRAME_HEAD_BYTES)), stored)
    if found is not None and found != declared:
        raise file.damaged(f"a chunk declares {declared} bytes and its content {found}")


def read_attachment_record(file: BoundedFile, index: AttachmentIndex) -> bytes:
    """Read the record of an attachment and compare it with its checksum.

    Parameters
    ----------
    file
        The file.
    index
        The attachment's entry in the file's index.

    Returns
    -------
    The record without its opcode and length.

    Raises
    ------
    ArtifactError
        It fails its checksum.
    """
    record = file.read_at(index.offset, index.length)
    body, stored = record[RECORD_HEAD_BYTES:-CRC_BYTES], record[-CRC_BYTES:]
    if zlib.crc32(body) != int.from_bytes(stored, "little"):
        raise file.damaged(f"attachment '{index.name}' does not match its checksum")
    return record[RECORD_HEAD_BYTES:]


def _footer(file: BoundedFile) -> tuple[int, int, int]:
    """Start of the index, start of the footer, and the checksum over both."""
    footer_at = file.size - FOOTER.size - len(MAGIC)
    if footer_at < len(MAGIC) or file.read_at(0, len(MAGIC)) != MAGIC:
        raise file.damaged("it is no MCAP file")
    opcode, _, start, _, stored = FOOTER.unpack(file.read_at(footer_at, FOOTER.size))
    if opcode != Opcode.FOOTER or file.read(len(MAGIC)) != MAGIC:
        raise file.damaged("it is cut short: its footer is missing")
    if not len(MAGIC) + DATA_END.size <= start < footer_at or stored == 0:
        raise file.damaged("it has no index, or one without a checksum")
    return start, footer_at, stored


def _content_bytes(compression: str, head: bytes, stored: int) -> int | None:
    """Size of a chunk's content as its frame declares it; None where it declares none."""
    if compression == "zstd":
        size = zstandard.frame_content_size(head)
        return None if size < 0 else size
    if compression == "lz4":
        declared: int = lz4.frame.get_frame_info(head)["content_size"]
        return declared or None
    return stored
