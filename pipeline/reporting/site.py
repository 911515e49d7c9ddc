"""The documentation as a site: the project's pages, and a reference made from the docstrings."""

import pkgutil
import posixpath
import re
import shutil
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path

import pdoc
from markdown_it import MarkdownIt
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token
from markdown_it.utils import EnvType, OptionsDict

from pipeline.reporting.page import markdown_page

REFERENCE = "reference"
DOCUMENTED = ("pipeline", "stages")
PAGES = {  # page of the repository → file of the site
    "README.md": "index.html",
    "pipeline/README.md": "science.html",
    "runs/FIRST_HOUR.md": "first_hour.html",
    "runs/ON_YOUR_ROBOT.md": "robot.html",
    "runs/README.md": "running.html",
    "runs/MILLION.md": "million.html",
    "stages/README.md": "stages.html",
    "schemas/README.md": "files.html",
    "schemas/TABLES.md": "tables.html",
    "CHANGELOG.md": "changelog.html",
}


def write_site(root: Path, folder: Path) -> None:
    """Write the whole site into a folder; what it held before goes.

    Parameters
    ----------
    root
        The repository's top folder, with the pages and the packages.
    folder
        Where ``index.html`` appears.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    modules = sorted(documented_modules())
    write_reference(modules, folder / REFERENCE)
    for page, name in PAGES.items():
        text = (root / page).read_text()
        (folder / name).write_text(page_html(text, page, modules))
        for target in shown_files(text):
            source = posixpath.normpath(posixpath.join(posixpath.dirname(page), target))
            if source not in PAGES:
                copy = folder / source
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(root / source, copy)


def write_reference(modules: Sequence[str], folder: Path) -> None:
    """Write a page for each module, made from its docstrings."""
    for module in modules:
        import_module(module)
    # pdoc finds the modules of a package by itself, but not those that its __all__ leaves out.
    hidden = set(modules) - set(pdoc.extract.walk_specs(DOCUMENTED))
    roots = sorted(name for name in hidden if name.rpartition(".")[0] not in hidden)
    pdoc.render.configure(docformat="numpy", footer_text="softgrip")
    pdoc.pdoc(*DOCUMENTED, *roots, output_directory=folder)


def documented_modules() -> Iterator[str]:
    """Names of all modules of the packages that the reference covers."""
    for package in DOCUMENTED:
        yield package
        path = [str(Path(__file__).resolve().parents[2] / package)]
        for module in pkgutil.walk_packages(path, f"{package}."):
            if not module.name.endswith(".__main__"):
                yield module.name


def shown_files(markdown: str) -> list[str]:
    """Relative paths that a page links to or shows as a picture."""
    return [target for target in re.findall(r"\]\(([^)#]+)\)", markdown) if "://" not in target]


def page_html(markdown: str, page: str, modules: Sequence[str]) -> str:
    """A page as HTML, whose links lead to the site's files.

    Parameters
    ----------
    markdown
        The page's text.
    page
        Its path in the repository: what its links are relative to.
    modules
        Modules of the reference: a name of one of their members becomes a link to it.

    Returns
    -------
    The HTML.
    """
    parser = MarkdownIt("commonmark", {"html": False}).enable("table")
    for rule in ("image", "link_open", "code_inline"):
        parser.add_render_rule(rule, {"code_inline": _code}.get(rule, _relinked))
    env = {"folder": posixpath.dirname(page), "modules": frozenset(modules)}
    links = " · ".join(f"[{name}]({file})" for name, file in _menu().items())
    menu = MarkdownIt("commonmark").render(links)
    return markdown_page(
        "page.html.jinja", {"title": page, "body": menu + parser.render(markdown, env)}
    )


def reference_link(name: str, modules: frozenset[str]) -> str | None:
    """Where the reference describes a dotted name, or None where it does not.

    Parameters
    ----------
    name
        A module, or a member of one, such as ``pipeline.gripper.pad.build_pad``.
    modules
        Modules that the reference covers.

    Returns
    -------
    Path within the site, with the member's anchor.
    """
    module, _, member = name.rpartition(".")
    if name in modules:
        return f"{REFERENCE}/{name.replace('.', '/')}.html"
    if module in modules:
        return f"{REFERENCE}/{module.replace('.', '/')}.html#{member}"
    return None


def _menu() -> dict[str, str]:
    """Name → file of what every page links to in its first line."""
    pages = {Path(file).stem.replace("index", "softgrip"): file for file in PAGES.values()}
    return {**pages, "reference": f"{REFERENCE}/index.html"}


def _relinked(
    renderer: RendererHTML, tokens: Sequence[Token], index: int, options: OptionsDict, env: EnvType
) -> str:
    """A link or a picture, with its target in the site."""
    token = tokens[index]
    key = "src" if token.type == "image" else "href"
    target = str(token.attrs[key])
    if "://" not in target and not target.startswith("#"):
        path, mark, anchor = target.partition("#")
        path = posixpath.normpath(posixpath.join(env["folder"], path))
        token.attrs[key] = PAGES.get(path, path) + mark + anchor
    if token.type == "image":
        token.attrs["alt"] = token.content
    return renderer.renderToken(tokens, index, options, env)


def _code(
    renderer: RendererHTML, tokens: Sequence[Token], index: int, options: OptionsDict, env: EnvType
) -> str:
    """Code in a line; the name of something in the reference links to it."""
    shown = renderer.code_inline(tokens, index, options, env)
    link = reference_link(tokens[index].content, env["modules"])
    return f'<a href="{link}">{shown}</a>' if link else shown
