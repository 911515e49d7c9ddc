"""A key changes with configuration, code and content, and with nothing else."""

import json
import os
from pathlib import Path

from pipeline.config import RunConfig
from pipeline.execution import freshness
from pipeline.execution.freshness import (
    Key,
    code_digests,
    content_digests,
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


def test_code_reached_by_import_counts_and_other_code_does_not() -> None:
    reached = code_digests("pipeline.artifacts.tensors")
    assert "pipeline/artifacts/tensors.py" in reached
    assert "pipeline/errors.py" in reached
    assert "schemas/softgrip/v1/tensor_pb2.py" in reached
    assert not any(path.startswith("pipeline/execution") for path in reached)


def test_configuration_text_is_left_to_its_values() -> None:
    assert not any("config" in path for path in code_digests("pipeline.gripper.quality"))


def test_edited_code_changes_the_key(tmp_path: Path) -> None:
    package = tmp_path / "pipeline"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "a.py").write_text("from pipeline import b\n")
    (package / "b.py").write_text("X = 1\n")
    root = freshness.ROOT
    try:
        freshness.ROOT = tmp_path
        code_digests.cache_clear()
        before = code_digests("pipeline.a")
        (package / "b.py").write_text("X = 2\n")
        code_digests.cache_clear()
        after = code_digests("pipeline.a")
    finally:
        freshness.ROOT = root
        code_digests.cache_clear()
    changed = [path for path in after if after[path] != before[path]]
    assert changed == ["pipeline/b.py"]


def test_differences_are_told_in_words() -> None:
    old = Key({"grasps": "1"}, {"a.py": "1"}, {"x.mcap": "1", "gone": "1"})
    new = Key({"grasps": "2"}, {"a.py": "1"}, {"x.mcap": "2"})
    assert new.differences(old) == [
        "configuration grasps changed",
        "input x.mcap changed",
        "input gone is gone",
    ]


def test_a_key_survives_its_file(tmp_path: Path) -> None:
    key = stage_key(RunConfig(), ("seed",), "pipeline.errors", {}, tmp_path / "memo.json")
    assert key_from_json(key.to_json()) == key
    assert json.loads(key.to_json())["config"].keys() == {"seed"}
