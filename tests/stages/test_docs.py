"""The site of `make docs`: every link of every page leads somewhere."""

import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest

from pipeline.reporting.site import PAGES, documented_modules, reference_link
from stages.docs import docs


class Page(HTMLParser):
    """Targets and anchors of an HTML page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        if tag in ("a", "img", "link", "script"):
            self.targets += [t for t in (found.get("href"), found.get("src")) if t]
        if identifier := found.get("id"):
            self.anchors.add(identifier)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("docs") / "site"
    docs(folder)
    return folder


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Page]:
    return {path: Page(path.read_text()) for path in site.rglob("*.html")}


def test_every_module_has_a_page(site: Path) -> None:
    for module in documented_modules():
        link = reference_link(module, frozenset([module]))
        assert link
        assert (site / link).is_file(), f"{module} has no page"


def test_no_link_is_broken(pages: dict[Path, Page], site: Path) -> None:
    broken = []
    for path, page in pages.items():
        for target in page.targets:
            if re.match(r"[a-z]+:", target):
                continue
            file, _, anchor = unquote(target).partition("#")
            there = (path.parent / file).resolve() if file else path
            if there.is_dir():
                there /= "index.html"
            if not there.is_file() or (
                anchor and there in pages and anchor not in pages[there].anchors
            ):
                broken.append(f"{path.relative_to(site)}: {target}")
    assert not broken


def test_the_site_needs_no_network(pages: dict[Path, Page], site: Path) -> None:
    loaded = [target for page in pages.values() for target in page.targets if "://" in target]
    assert all(target.startswith("https://pdoc.dev") for target in loaded), set(loaded)


def test_a_function_of_the_science_page_links_to_its_reference(site: Path) -> None:
    text = (site / PAGES["pipeline/README.md"]).read_text()
    assert 'href="reference/pipeline/gripper/pad.html#build_pad"' in text
