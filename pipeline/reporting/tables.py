"""Tables beside a report: what a step of the lineage holds, where no recording shows it."""

from collections.abc import Mapping
from pathlib import Path

from pipeline.asking.cache import QUERY_CACHE
from pipeline.asking.query import OpenTables, open_tables
from pipeline.execution import RunFolder
from pipeline.reporting.page import cell, html_page

MOST_ROWS = 1000  # a page of more is slow to open, and `make query` gives all
SOURCES = "sources"  # the step before the first stage
# Step → the question whose answer is its table.
QUESTIONS: Mapping[str, str] = {
    SOURCES: "SELECT source, 'object ' || object AS became, split FROM objects "
    "UNION ALL SELECT source, 'refused: ' || reason, NULL FROM refused ORDER BY source, became",
    "objects": "SELECT * FROM objects ORDER BY object",
    "scenes": "SELECT * FROM scenes",
    "grasps": "SELECT * FROM grasps",
    "samples": "SELECT * FROM samples",
    "network": "SELECT * FROM epochs ORDER BY epoch",
    "attempts": "SELECT * FROM attempts",
}


def table_pages(
    folder: RunFolder, artifacts: Mapping[str, Path], steps: Mapping[str, str]
) -> dict[str, bytes]:
    """Write the tables of some steps as HTML pages.

    Parameters
    ----------
    folder
        The run.
    artifacts
        Stage → its artifact, of the stages that are made.
    steps
        Step → path of its page.

    Returns
    -------
    Path → page.
    """
    with open_tables(artifacts, folder.state(QUERY_CACHE)) as tables:
        return {
            path: table_page(tables, step, folder.path.name).encode()
            for step, path in steps.items()
        }


def table_page(tables: OpenTables, step: str, run: str) -> str:
    """The first rows of a step's table as a page, and the question that gives all."""
    sql = QUESTIONS[step]
    (count,) = tables.ask(f"SELECT count(*) AS n FROM ({sql})").column("n").to_pylist()
    answer = tables.ask(f"SELECT * FROM ({sql}) LIMIT {MOST_ROWS}")
    title = f"Run {run}: {step}"
    told = f"{count} rows" if count <= MOST_ROWS else f"The first {MOST_ROWS} of {count} rows"
    lines = [
        f"# {cell(title)}",
        "",
        f'{told} of `make query RUN={run} SQL="{sql}"`.',
        "",
        f"| {' | '.join(map(cell, answer.column_names))} |",
        "|-" * answer.num_columns + "|",
    ]
    for row in answer.to_pylist():
        cells = ["" if value is None else cell(value) for value in row.values()]
        lines.append(f"| {' | '.join(cells)} |")
    return html_page("\n".join(lines) + "\n", title, {})
