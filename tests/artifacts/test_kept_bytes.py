"""Bytes kept in a file: made once, made again where the file is damaged or cannot be."""

from pathlib import Path

from pipeline.artifacts.kept_bytes import kept_bytes

MADE = b"what took long to make"


def never() -> bytes:
    raise AssertionError("made again")


def test_they_are_made_once(tmp_path: Path) -> None:
    path = tmp_path / "kept"
    assert kept_bytes(path, lambda: MADE) == MADE
    assert kept_bytes(path, never) == MADE
    assert list(tmp_path.iterdir()) == [path]


def test_a_damaged_file_is_made_again(tmp_path: Path) -> None:
    path = tmp_path / "kept"
    kept_bytes(path, lambda: MADE)
    whole = path.read_bytes()
    for damaged in (b"", whole[:-1], whole[:-1] + b"?", b"?" + whole[1:]):
        path.write_bytes(damaged)
        assert kept_bytes(path, lambda: MADE) == MADE
        assert path.read_bytes() == whole


def test_where_nothing_can_be_kept_they_are_made_each_time(tmp_path: Path) -> None:
    (tmp_path / "a file").touch()
    path = tmp_path / "a file" / "kept"
    assert kept_bytes(path, lambda: MADE) == MADE
    assert kept_bytes(path, lambda: MADE) == MADE
