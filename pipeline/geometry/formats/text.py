"""Lines and numbers of text formats, and what is wrong with them where something is."""

import re
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from pipeline.errors import MeshError

_MARK = b"\xef\xbb\xbf"
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")
# How C libraries print what is no number; Python reads the others (nan, inf, infinity) itself.
_NOT_A_NUMBER = re.compile(rb"[+-]?(1\.#(IND|QNAN|SNAN|INF)\d*|s?nan\(.*\))", re.IGNORECASE)
_ANY_COMMENT = re.compile(rb"#[^\n]*")
_COMMENT = re.compile(rb"(?:(?<!1\.)#|#(?!IND|QNAN|SNAN|INF))[^\n]*")
_FORTRAN = re.compile(rb"([\d.])[dD](?=[+-]?\d)")  # 1.0D-2
_COMMA = re.compile(rb"[+-]?\d*,\d+([eE][+-]?\d+)?|[+-]?[\d.]+,")


def text_of(label: str, data: bytes) -> bytes:
    """The text with LF line ends and one at its end, without a byte-order mark.

    Parameters
    ----------
    label
        The file, as errors name it.
    data
        Its bytes.

    Returns
    -------
    The text, as bytes.

    Raises
    ------
    MeshError
        It is UTF-16, or holds bytes that no text has.
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise MeshError(f"{label} is UTF-16 text", "Save it as UTF-8 or plain ASCII")
    text = data.removeprefix(_MARK).rstrip(b"\x1a \t\r\n\0")  # padding, and the end mark of DOS
    if b"\r" in text:
        text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    text = text.replace(b"\x0b", b" ").replace(b"\x0c", b" ")  # blanks to all that read words
    found = _CONTROL.search(text)
    if found:
        line = text.count(b"\n", 0, found.start()) + 1
        raise MeshError(
            f"{label} is not text from line {line} on: it has a byte {text[found.start()]:#04x} "
            "there",
            "Export the mesh again, as text or as binary throughout",
        )
    return text + b"\n"


def without_comments(text: bytes) -> bytes:
    """The text without what follows a # on its lines."""
    if b"#" not in text:
        return text
    # Windows prints NaN as 1.#IND: that # begins no comment.
    return (_COMMENT if b"1.#" in text else _ANY_COMMENT).sub(b"", text)


def reals(label: str, words: Sequence[bytes]) -> Float[np.ndarray, " n"]:
    """Numbers from words. Raises MeshError that says of the first that is none what it is."""
    joined = b" ".join(words)
    if (b"d" in joined or b"D" in joined) and _FORTRAN.search(joined):
        words = _FORTRAN.sub(rb"\1e", joined).split()
    try:
        if b"_" not in joined:  # Python reads 1_0 as ten
            return np.fromiter(map(float, words), dtype=np.float64, count=len(words))
    except ValueError:
        pass
    for word in words:
        check_number(label, word)
    raise MeshError(f"{label} has words where numbers belong", "Export the mesh again")


def integers(label: str, words: Sequence[bytes]) -> Int[np.ndarray, " n"]:
    """Whole numbers from words. Raises MeshError that names the first that is none."""
    try:
        if b"_" not in b" ".join(words):  # Python reads 1_0 as ten
            return np.fromiter(map(int, words), dtype=np.int64, count=len(words))
    except (ValueError, OverflowError):
        pass
    for word in words:
        check_whole_number(label, word)
    raise MeshError(f"{label} has words where whole numbers belong", "Export the mesh again")


def check_number(where: str, word: bytes) -> None:
    """Raise MeshError where a word is no number, with the reason."""
    shown = _shown(word)
    if _NOT_A_NUMBER.fullmatch(word):
        raise MeshError(f"{where} has a number that is NaN or infinite ({shown})", "Mend the mesh")
    if _COMMA.fullmatch(word):
        raise MeshError(
            f"{where} has {shown} where a number belongs: a comma is no decimal mark there",
            "Export the mesh with decimal points",
        )
    try:
        float(_FORTRAN.sub(rb"\1e", word))
    except ValueError:
        pass
    else:
        if b"_" not in word:
            return
    raise MeshError(f"{where}: {shown} is no number", "Mend that line, or export the mesh again")


def check_whole_number(where: str, word: bytes) -> None:
    """Raise MeshError where a word is no whole number of a vertex."""
    if not re.fullmatch(rb"[+-]?\d{1,18}", word):
        raise MeshError(
            f"{where}: {_shown(word)} is no number of a vertex",
            "Mend that line, or export the mesh again",
        )


def _shown(word: bytes) -> str:
    return repr(word[:24].decode("utf-8", errors="replace"))


def plain_triples(text: bytes, keyword: bytes, lines: int) -> list[bytes] | None:
    """The words behind a keyword where every line that begins with it has three, quickly.

    Parameters
    ----------
    text
        Lines that end in LF.
    keyword
        A pattern of the lines' first word.
    lines
        How many lines begin with it.

    Returns
    -------
    Three words a line, in order; None where a line has more or fewer.
    """
    row = rb"^[ \t]*" + keyword + rb"[ \t]+([^ \t\n]+[ \t]+[^ \t\n]+[ \t]+[^ \t\n]+)[ \t]*$"
    found = re.findall(row, text, re.MULTILINE)
    return b" ".join(found).split() if len(found) == lines else None
