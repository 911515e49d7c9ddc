"""What a file is by its first bytes, where it is no mesh whatever its name says."""

from pipeline.errors import MeshError

_EXPORT_AGAIN = "Export the mesh again, or fetch the file again"
_PAGES = (b"<!doctype html", b"<html", b"<head", b"<!--")
_KINDS = (
    (b"version https://git-lfs", "a Git LFS pointer", "Run git lfs pull"),
    (b"<?xml", "an XML document", "Export it in the format that its name says"),
    (b"PK\x03\x04", "a ZIP archive", "Unpack it"),
    (b"\x1f\x8b", "packed by gzip", "Unpack it"),
    (b"BZh", "packed by bzip2", "Unpack it"),
    (b"\xfd7zXZ", "packed by xz", "Unpack it"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "Unpack it"),
    (b"Rar!\x1a", "a RAR archive", "Unpack it"),
    (b"%PDF-", "a PDF document", _EXPORT_AGAIN),
    (b"\x89PNG\r\n", "a PNG picture", _EXPORT_AGAIN),
    (b"\xff\xd8\xff", "a JPEG picture", _EXPORT_AGAIN),
    (b"Kaydara FBX", "an FBX file", "Export it in the format that its name says"),
    (b"ISO-10303-21", "a STEP file", "Export it as a mesh"),
)


def check_kind(label: str, data: bytes) -> None:
    """Raise MeshError where a file is empty, or is something else than a mesh.

    Parameters
    ----------
    label
        The file, for the message.
    data
        The whole file.
    """
    if not data.strip(b"\0 \t\r\n"):
        raise MeshError(f"{label} is empty", _EXPORT_AGAIN)
    start = data[:512].lstrip(b"\xef\xbb\xbf \t\r\n")
    if start.lower().startswith(_PAGES) or b"<!doctype html" in start.lower():
        raise MeshError(f"{label} is a web page, not a mesh", "Download the mesh itself")
    for mark, kind, remedy in _KINDS:
        if start.startswith(mark):
            raise MeshError(f"{label} is {kind}, not a mesh of its name's format", remedy)
