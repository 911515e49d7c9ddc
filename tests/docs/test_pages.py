"""What the pages say is there is there: functions, files, goals of Make, licence, citation."""

import importlib
import inspect
import re
from pathlib import Path

import pytest
import yaml

from pipeline.artifacts import package_version
from pipeline.config import load_run_config
from tests.docs.pages import PAGES, ROOT, blocks_of

SCIENCE = (ROOT / "pipeline" / "README.md").read_text()
ROWS = re.findall(r"^\| (.+?) \| .+ \| `(pipeline\.[\w.]+)` \|$", SCIENCE, flags=re.MULTILINE)


def found(dotted: str) -> tuple[object, object]:
    """The thing a dotted name stands for, and its module."""
    module, _, name = dotted.rpartition(".")
    loaded = importlib.import_module(module)
    return getattr(loaded, name), loaded


@pytest.mark.parametrize(("source", "dotted"), ROWS)
def test_a_function_of_the_science_page_names_its_source(source: str, dotted: str) -> None:
    thing, module = found(dotted)
    assert inspect.getdoc(thing)
    # Its own text, or the head of its module: another function of the module does not count.
    text = f"{inspect.getdoc(module)}\n{inspect.getsource(thing)}"  # type: ignore[arg-type]
    for name in re.findall(r"Eq\. \(\d+\)|S-1\.\d+|Table I+", source):
        assert name in text or covered(name, text), f"{dotted} does not speak of {name}"


def covered(name: str, text: str) -> bool:
    """Whether a range such as «Eq. (8)-(11)» or «S-1.07 - S-1.12», or a list, includes it."""
    number = int(re.findall(r"\d+", name)[-1]) if any(c.isdigit() for c in name) else -1
    if name.startswith("Eq."):
        pairs = re.findall(r"Eq\. \((\d+)\)-\((\d+)\)", text)
        pairs += re.findall(r"\((\d+)\)-\((\d+)\)", text)
    else:
        pairs = re.findall(r"S-1\.(\d+)[ -]+S-1\.(\d+)", text)
    return any(int(low) <= number <= int(high) for low, high in pairs)


def test_the_science_page_has_every_equation() -> None:
    named = " ".join(source for source, _ in ROWS)
    numbers: set[int] = set()
    for low, high in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", named):
        numbers |= set(range(int(low), int(high or low) + 1))
    assert numbers == set(range(1, 16))
    steps = {int(step) for step in re.findall(r"S-1\.(\d+)", named)}
    assert steps == set(range(2, 16))  # S-1.01 is where physics left the object


def test_files_that_pages_name_are_there() -> None:
    for page in PAGES:
        text = (ROOT / page).read_text()
        named = re.findall(r"`((?:pipeline|stages|schemas|tests|runs)/[\w/]+\.(?:py|md))`", text)
        shown = re.findall(r"\]\((?!http)([^)#]+)\)", text)
        for target in named:
            assert (ROOT / target).exists(), f"{page} names {target}"
        for target in shown:
            assert ((ROOT / page).parent / target).exists(), f"{page} shows {target}"


def test_goals_of_make_that_pages_name_exist() -> None:
    makefile = (ROOT / "Makefile").read_text()
    phony = re.search(r"^\.PHONY: (.*)$", makefile, flags=re.MULTILINE)
    assert phony
    goals = set(phony.group(1).split())
    for page in PAGES:
        text = (ROOT / page).read_text()
        assert set(re.findall(r"(?:^|`)make ([a-z]+)", text, flags=re.MULTILINE)) <= goals


@pytest.mark.parametrize("block", [block for page in PAGES for block in blocks_of(page, "toml")])
def test_a_piece_of_run_toml_that_a_page_shows_is_one(block: str, tmp_path: Path) -> None:
    path = tmp_path / "run.toml"
    path.write_text(block)
    load_run_config(path)


def test_readme_can_be_read_in_a_minute() -> None:
    assert len((ROOT / "README.md").read_text().splitlines()) <= 200


def test_the_citation_is_of_this_version() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == package_version()
    assert citation["license"] == "Apache-2.0"
    assert citation["authors"]
    for key in ("cff-version", "message", "title"):
        assert citation[key]
    for reference in citation["references"]:
        assert {"type", "title", "authors"} <= set(reference)


def test_the_licence_is_there_in_full() -> None:
    text = (ROOT / "LICENSE").read_text()
    assert "Apache License" in text
    assert "END OF TERMS AND CONDITIONS" in text
