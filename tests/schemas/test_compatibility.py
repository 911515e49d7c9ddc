"""A released schema may grow; whatever would stop an old file from being read is found."""

import subprocess
import sys
from pathlib import Path

import pytest

from schemas.compatibility import breaking_changes, messages_of, problems, read_released, versions

ROOT = Path(__file__).resolve().parents[2]
RELEASED = {"softgrip.v1.A": {"1": "string name", "2": "double nsvr", "3": "repeated bytes parts"}}


def test_nothing_released_is_broken() -> None:
    assert problems() == []


def test_every_message_is_listed() -> None:
    (version,) = versions()
    released = read_released(version)
    assert set(released) <= set(messages_of(version))
    assert released["softgrip.v1.Tensor"] == {
        "1": "string dtype",
        "2": "repeated uint64 shape",
        "3": "bytes data",
    }
    # A map is a message of its own.
    assert released["softgrip.v1.LevelResult.FailuresEntry"]["1"] == "string key"


def test_growing_is_allowed() -> None:
    more = {**RELEASED["softgrip.v1.A"], "4": "string unit"}
    assert breaking_changes({"softgrip.v1.A": more, "softgrip.v1.B": {}}, RELEASED) == []


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"1": "string name", "2": "double nsvr"}, "field 3 'repeated bytes parts' was removed"),
        (
            {"1": "string name", "5": "double nsvr", "3": "repeated bytes parts"},
            "field 2 'double nsvr' was renumbered to 5",
        ),
        (
            {"1": "string name", "2": "float nsvr", "3": "repeated bytes parts"},
            "field 2 was 'double nsvr' and is 'float nsvr'",
        ),
        (
            {"1": "string name", "2": "double nsvr", "3": "bytes parts"},
            "field 3 was 'repeated bytes parts' and is 'bytes parts'",
        ),
        (
            {"1": "string title", "2": "double nsvr", "3": "repeated bytes parts"},
            "field 1 was 'string name' and is 'string title'",
        ),
    ],
)
def test_what_breaks_is_told(fields: dict[str, str], said: str) -> None:
    (found,) = breaking_changes({"softgrip.v1.A": fields}, RELEASED)
    assert said in found


def test_a_removed_message_is_told() -> None:
    assert breaking_changes({}, RELEASED) == ["softgrip.v1.A was removed"]


def test_the_check_of_lint_fails_on_a_breaking_change(tmp_path: Path) -> None:
    """The real check, on a copy of the sources from which one field was taken."""
    for source in ROOT.glob("schemas/**/*"):
        if source.suffix in (".py", ".pyi", ".proto", ".json"):
            copy = tmp_path / source.relative_to(ROOT)
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(source.read_bytes())
    proto = tmp_path / "schemas/softgrip/v1/samples.proto"
    lines = proto.read_text().splitlines()
    proto.write_text("\n".join(line for line in lines if " quality = " not in line))

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", *words],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )

    assert (
        "samples_pb2.py is not what its .proto gives" in run("schemas.generate", "--check").stderr
    )
    assert run("schemas.generate").returncode == 0
    checked = run("schemas.generate", "--check")
    assert checked.returncode == 1
    assert "SampleBatch: field 3 'softgrip.v1.Tensor quality' was removed" in checked.stderr
