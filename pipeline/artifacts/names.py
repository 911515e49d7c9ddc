"""Names in messages that become names of files: none leads out of a folder."""

import re

from pipeline.errors import ContentError

_FILE_NAME = re.compile(r"[a-z0-9_-]{1,240}")


def file_name(name: str) -> str:
    """``name``, where it is a slug as the stages give them.

    Raises
    ------
    ContentError
        It is none, as ``../x`` or the empty name.
    """
    if not _FILE_NAME.fullmatch(name):
        raise ContentError(f"{name[:80]!r} is no name of an object or a scene")
    return name
