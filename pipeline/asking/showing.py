"""The grasps, or attempts, that an answer names as a recording of just these."""

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa

from pipeline.config import RunConfig
from pipeline.errors import QueryError
from pipeline.recording.chosen import Chosen, draw_chosen_attempts, draw_chosen_grasps

MOST_SHOWN = 500  # grasps: some 100 MB, which a viewer opens in seconds
MOST_ATTEMPTS = 60  # a film of each
GRASP, ATTEMPT = ("scene", "grasp"), ("scene", "policy", "attempt")


def show_answer(
    answer: pa.Table, artifacts: Mapping[str, Path], config: RunConfig, path: Path
) -> Path:
    """Draw what an answer names.

    Parameters
    ----------
    answer
        With columns scene and grasp, or scene, policy and attempt.
    artifacts
        Stage → its artifact, of the stages that are made.
    config
        The run's configuration.
    path
        Where the recording goes.

    Returns
    -------
    The recording.

    Raises
    ------
    QueryError
        The answer has no such columns, names nothing, or more than a viewer can open.
    """
    names = set(answer.column_names)
    if names.issuperset(ATTEMPT):
        rows, most, what = named_rows(answer, ATTEMPT), MOST_ATTEMPTS, "attempts"
    elif names.issuperset(GRASP):
        rows, most, what = named_rows(answer, GRASP), MOST_SHOWN, "grasps"
    else:
        raise QueryError(
            "The answer does not say which grasps or attempts to show",
            f"Ask for columns {' and '.join(GRASP)}, or {', '.join(ATTEMPT)}",
        )
    if not 0 < len(rows) <= most:
        raise QueryError(
            f"The answer names {len(rows)} {what}, and a recording shows 1 to {most}",
            f"End the question with LIMIT {most}, or ask another" if rows else "Ask another",
        )
    digest = hashlib.sha256(repr((what, rows)).encode()).hexdigest()
    drawing = Chosen("evaluate" if what == "attempts" else "grasps", path, digest, config)
    if what == "attempts":
        draw_chosen_attempts(
            drawing, artifacts, [(str(s), str(p or ""), int(a)) for s, p, a in rows]
        )
    else:
        draw_chosen_grasps(drawing, artifacts, [(str(s), int(g)) for s, g in rows])
    return path


def named_rows(answer: pa.Table, columns: tuple[str, ...]) -> list[tuple[Any, ...]]:
    """The values of some columns, each row once, in the order of the answer."""
    values = answer.select(list(columns)).to_pylist()
    return list(dict.fromkeys(tuple(row[name] for name in columns) for row in values))
