"""The report as one Markdown text, and as one HTML page that needs no other file."""

import base64
from collections.abc import Collection, Mapping, Sequence
from pathlib import PurePosixPath

from jinja2 import Environment, PackageLoader, StrictUndefined
from markdown_it import MarkdownIt
from markdown_it.renderer import RendererHTML
from markdown_it.token import Token
from markdown_it.utils import EnvType, OptionsDict

MEDIA_TYPES = {".svg": "image/svg+xml", ".jpg": "image/jpeg", ".png": "image/png"}


def markdown_page(template: str, facts: Mapping[str, object]) -> str:
    """A template of this package, filled in; an unknown name in it is an error."""
    environment = Environment(
        loader=PackageLoader("pipeline.reporting", "."),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # the text is Markdown; HTML in it is shown as text
    )
    environment.filters["cell"] = cell
    return environment.get_template(template).render(facts)


def cell(value: object) -> str:
    """A value in a table's cell: Markdown's marks in it are shown, not obeyed."""
    text = str(value).replace("\n", " ")
    return "".join(f"\\{mark}" if mark in "\\|`*_[]<>" else mark for mark in text)


def html_page(
    markdown: str, title: str, files: Mapping[str, bytes], linked: Collection[str] = ()
) -> str:
    """The page of a Markdown text, the pictures it shows inside.

    Parameters
    ----------
    markdown
        The text.
    title
        Of the browser's window.
    files
        Path as the text names it → content.
    linked
        Paths of SVG pictures of ours with links in them: they become part of the page.

    Returns
    -------
    HTML that needs no other file.
    """
    parser = MarkdownIt("commonmark", {"html": False}).enable("table")
    parser.add_render_rule("image", _embedded)
    body = parser.render(markdown, {"files": files, "linked": linked})
    return markdown_page("page.html.jinja", {"title": title, "body": body})


def _embedded(
    renderer: RendererHTML, tokens: Sequence[Token], index: int, options: OptionsDict, env: EnvType
) -> str:
    """A picture as a data URI, its caption the alternative text; a linked one as it is."""
    token = tokens[index]
    path = str(token.attrs["src"])
    if path in env["linked"]:
        return str(env["files"][path].decode())
    media = MEDIA_TYPES[PurePosixPath(path).suffix]
    data = base64.b64encode(env["files"][path]).decode()
    return f'<img alt="{token.content}" src="data:{media};base64,{data}">'
