"""Names of objects: readable in any script, distinct, and the same when other files are added.

A name is made of its file's path in the folder, and is fit for a file. Where two files would have
one name, one of them has it, and the other's ends in digits of its path's digest.
"""

import hashlib
import unicodedata
from collections.abc import Collection, Mapping
from fnmatch import fnmatchcase
from itertools import groupby
from pathlib import PurePosixPath

from pipeline.artifacts.names import belongs_in_name

# Of the 240 bytes that a name may have; digits and the numbers of stretched copies come behind it.
_MOST_BYTES = 160
_DIGEST_DIGITS = 6


def readable_name(label: str) -> str:
    """The name that a file has by its path alone.

    Parameters
    ----------
    label
        The file's path in its folder, with ``/``.

    Returns
    -------
    The path without its ending, composed (NFC) and in lower case; letters, digits and marks of
    any script, ``_`` and ``-`` stay, and whatever lies between them becomes one ``_``. A path
    without any is ``object-`` and digits of its digest.
    """
    path = unicodedata.normalize("NFC", _without_ending(label)).lower()
    seen = (char for char in path if unicodedata.category(char) != "Cf")  # joiners and the like
    pieces = ("".join(run) if fit else "_" for fit, run in groupby(seen, belongs_in_name))
    name = unicodedata.normalize("NFC", "".join(pieces)).strip("_")
    if not name:
        return f"object-{_digest(label, _DIGEST_DIGITS)}"
    if len(name.encode()) > _MOST_BYTES:
        short = name.encode()[:_MOST_BYTES].decode(errors="ignore")
        return f"{short}-{_digest(label, _DIGEST_DIGITS)}"
    return name


def distinct_names(labels: Collection[str], settled: Mapping[str, str]) -> dict[str, str]:
    """A name for each file, none twice.

    Parameters
    ----------
    labels
        Paths of the files in their folder; their order does not matter.
    settled
        Names that an earlier making of the run gave, by path: they stay.

    Returns
    -------
    Path → name. Of new files that want one name, the one whose path is written as the name is has
    it, else the first by path.
    """
    names = {label: settled[label] for label in labels if label in settled}
    taken = set(names.values())
    new = [label for label in labels if label not in names]
    for label in sorted(new, key=lambda at: (_without_ending(at) != readable_name(at), at)):
        name, digits = readable_name(label), _DIGEST_DIGITS
        while name in taken:
            name = f"{readable_name(label)}-{_digest(label, digits)}"
            digits += 1
        names[label] = name
        taken.add(name)
    return names


def is_named(name: str, pattern: str) -> bool:
    """Whether a pattern of a person's, with * and ?, fits a name, however its letters are coded."""
    return fnmatchcase(name, unicodedata.normalize("NFC", pattern))


def _without_ending(label: str) -> str:
    return PurePosixPath(label).with_suffix("").as_posix()


def _digest(text: str, digits: int) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:digits]
