"""A key changes with configuration, code and content, and with nothing else."""

import json
import os
import platform
from pathlib import Path

import pytest

from pipeline.artifacts.digests import content_digests
from pipeline.config import RunConfig
from pipeline.execution.freshness import (
    Key,
    drawing_key,
    key_from_json,
    stage_key,
)


def test_touching_a_file_changes_nothing(tmp_path: Path) -> None:
    file = tmp_path / "a.bin"
    file.write_bytes(b"x")
    memo = tmp_path / "memo.json"
    before = content_digests({"a": file}, memo)
    os.utime(file, (1, 1))
    assert content_digests({"a": file}, memo) == before


def test_changing_a_file_changes_its_digest_even_at_the_same_size(tmp_path: Path) -> None:
    file = tmp_path / "a.bin"
    file.write_bytes(b"x")
    memo = tmp_path / "memo.json"
    before = content_digests({"a": file}, memo)
    file.write_bytes(b"y")
    os.utime(file, (5, 5))
    assert content_digests({"a": file}, memo) != before


def test_a_damaged_memo_is_only_a_slower_start(tmp_path: Path) -> None:
    file, memo = tmp_path / "a.bin", tmp_path / "memo.json"
    file.write_bytes(b"x")
    before = content_digests({"a": file}, memo)
    memo.write_text("{broken")
    assert content_digests({"a": file}, memo) == before


def test_differences_are_told_in_words() -> None:
    old = Key({"grasps": "1"}, {"a.py": "1"}, {"python": "3.11", "numpy": "2"}, {"x.mcap": "1"})
    new = Key({"grasps": "2"}, {"b.py": "1"}, {"python": "3.12", "renderer": "r"}, {"x.mcap": "2"})
    assert new.differences(old) == [
        "configuration grasps changed",
        "code b.py changed",
        "code a.py is gone",
        "input x.mcap changed",
        "numpy was 2, is absent",
        "python was 3.11, is 3.12",
        "renderer was absent, is r",
    ]


def test_every_part_is_in_the_digest() -> None:
    parts = {"config": {"a": "1"}, "code": {"a": "1"}, "machine": {"a": "1"}, "inputs": {"a": "1"}}
    digests = {Key(**{**parts, part: {"a": "2"}}).digest for part in parts}
    assert len(digests | {Key(**parts).digest}) == 5


def test_a_key_survives_its_file_and_an_earlier_softgrips_is_none(tmp_path: Path) -> None:
    key = stage_key(RunConfig(), ("seed",), "pipeline.errors", {}, tmp_path / "memo.json", "r")
    assert key_from_json(key.to_json()) == key
    assert key.machine["renderer"] == "r"
    assert json.loads(key.to_json())["config"].keys() == {"seed"}
    for other in ('{"config": {}, "code": {}, "inputs": {}}', "[]", ""):
        with pytest.raises(ValueError, match=r"not the key|Expecting value"):
            key_from_json(other)


def test_python_is_part_of_a_key(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def key() -> Key:
        return stage_key(RunConfig(), ("seed",), "pipeline.errors", {}, tmp_path / "memo.json")

    before = key()
    monkeypatch.setattr(platform, "python_version", lambda: "3.99.0")
    assert key().differences(before) == [f"python was {before.machine['python']}, is 3.99.0"]


def test_a_recordings_key_follows_its_artifact_and_what_draws_alone() -> None:
    artifact, other = (Key({}, {name: "1"}, {}, {}) for name in ("a.py", "b.py"))
    module, shown = "pipeline.recording.objects", ("recording.objects",)
    config = RunConfig()
    key = drawing_key(config, shown, module, artifact)
    assert "pipeline/recording/colours.py" in key.code
    assert "rerun-sdk" in key.machine
    assert drawing_key(config, shown, module, other).differences(key) == ["input artifact changed"]
    fewer = RunConfig.model_validate({"recording": {"objects": 3}})
    assert drawing_key(fewer, shown, module, artifact).differences(key) == [
        "configuration recording.objects changed"
    ]


def test_a_result_that_lacks_inputs_for_want_of_time_has_a_key_of_its_own() -> None:
    key = Key({"seed": "a"}, {"stages/objects.py": "b"}, {"python": "3.11"}, {"meshes/x": "c"})
    short = key.cut_short(["x.ply"])
    assert key.is_final
    assert not short.is_final
    assert short.digest != key.digest
    assert key.cut_short([]) == key
    assert key.differences(short) == ["not finished, and tried again: x.ply"]
    assert key_from_json(short.to_json()) == short
