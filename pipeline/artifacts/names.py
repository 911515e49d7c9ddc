"""Names in messages that become names of files: none leads out of a folder."""

import unicodedata

from pipeline.errors import ContentError

LONGEST_BYTES = 240  # in UTF-8: a file's name may have 255, and exports add their ending


def belongs_in_name(char: str) -> bool:
    """Whether a character may stand in a name: a letter, mark or digit of any script, _ or -.

    Parameters
    ----------
    char
        One character.

    Returns
    -------
    False for blanks, punctuation, signs, and what is not seen.
    """
    return char in "_-" or unicodedata.category(char)[0] in "LMN"


def file_name(name: str) -> str:
    """Return ``name`` if it is fit for a file, on every file system.

    Parameters
    ----------
    name
        Name of an object or a scene from a message.

    Returns
    -------
    The same name: letters of any script in lower case and composed (NFC), digits, ``_`` and ``-``.

    Raises
    ------
    ContentError
        It holds anything else, as ``../x`` does, is too long or empty.
    """
    fit = all(belongs_in_name(char) for char in name)
    fit = fit and name == unicodedata.normalize("NFC", name.lower())
    if not fit or not 0 < len(name.encode()) <= LONGEST_BYTES:
        raise ContentError(f"{name[:80]!r} is no name of an object or a scene")
    return name
