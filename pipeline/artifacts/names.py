"""Names in messages that become names of files: none leads out of a folder."""

import re

from pipeline.errors import ContentError

_FILE_NAME = re.compile(r"[a-z0-9_-]{1,240}")


def file_name(name: str) -> str:
    """Return ``name`` if it is fit for a file: lower-case letters, digits, ``_`` and ``-``.

    Parameters
    ----------
    name
        Name of an object or a scene from a message.

    Returns
    -------
    The same name.

    Raises
    ------
    ContentError
        It holds anything else, as ``../x`` does, or is empty.
    """
    if not _FILE_NAME.fullmatch(name):
        raise ContentError(f"{name[:80]!r} is no name of an object or a scene")
    return name
