"""What a source file says is kept for its very bytes, and made again wherever that cannot be."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from pipeline.execution import source_facts
from pipeline.execution.source_facts import SourceFacts, facts_of, keep_facts

SOURCE = '"""Limits."""\n\nimport math\n\nLARGEST = math.pi\n'


class Project:
    """A source file whose facts are asked as a new process asks them."""

    def __init__(self, root: Path, patch: pytest.MonkeyPatch) -> None:
        self.file, self.source, self.parsed = root / "kept.json", root / "limits.py", 0
        self.source.write_text(SOURCE)
        made = source_facts._made

        def counted(source: bytes, module: str) -> SourceFacts:
            self.parsed += 1
            return made(source, module)

        patch.setattr(source_facts, "_ROOT", root)
        patch.setattr(source_facts, "_FILE", self.file)
        patch.setattr(source_facts, "_made", counted)

    def facts(self) -> SourceFacts:
        facts_of.cache_clear()
        source_facts._kept.cache_clear()
        found = facts_of(self.source, "pipeline.limits")
        keep_facts()
        return found


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Project]:
    yield Project(tmp_path, monkeypatch)
    facts_of.cache_clear()
    source_facts._kept.cache_clear()


def test_a_file_is_parsed_once(project: Project) -> None:
    first = project.facts()
    assert first.imports == ("math",)
    assert project.facts() == first
    assert project.parsed == 1


def test_a_change_is_seen(project: Project) -> None:
    first = project.facts()
    project.source.write_text(SOURCE.replace("math.pi", "math.tau"))
    assert project.facts().digest != first.digest
    project.source.write_text(SOURCE)
    assert project.facts() == first


@pytest.mark.parametrize("bad", [b"", b"{}", b"\x00" * 64])
def test_a_damaged_file_is_made_again(project: Project, bad: bytes) -> None:
    first = project.facts()
    project.file.write_bytes(bad)
    assert project.facts() == first
    assert project.parsed == 2
    assert project.facts() == first
    assert project.parsed == 2


def test_one_changed_digit_counts_for_nothing(project: Project) -> None:
    first = project.facts()
    data = project.file.read_bytes()
    at = data.index(first.digest.encode())
    project.file.write_bytes(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
    assert project.facts() == first


def test_where_nothing_can_be_written_it_is_found_each_time(project: Project) -> None:
    project.file.mkdir()
    first = project.facts()
    assert project.facts() == first
    assert project.parsed == 2
