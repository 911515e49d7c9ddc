"""What is declared for every run is found alike by SQLite, where rows are few, and by DuckDB."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pyarrow as pa
import pytest

from pipeline.asking import expectations, few_rows, query
from pipeline.asking.expectations import Found, check, check_expectations, declared_expectations
from pipeline.asking.tables import table_rows
from pipeline.config.expectations import EVERY, Expectation
from pipeline.errors import QueryError

# Table → what its rows become, in DuckDB's SQL; every expectation fails on some of them.
BROKEN = {
    "objects": (
        "SELECT * REPLACE ('same' AS family, 1.5 AS nsvr, CASE WHEN faces % 2 = 0 THEN NULL "
        "ELSE -mass_kg END AS mass_kg, CASE WHEN object = (SELECT min(object) FROM objects) "
        "THEN 'train' ELSE 'test' END AS split) FROM objects",
        "SELECT * FROM objects WHERE false",
    ),
    "refused": ("SELECT 'a.stl' AS source, 'empty' AS reason, NULL AS remedy FROM range(9)",),
    "scenes": (
        "SELECT * REPLACE (objects + 1 AS objects, 99.5 AS settle_time_s) FROM scenes",
        "SELECT * REPLACE ('lost' AS scene) FROM scenes",
    ),
    "placed_objects": (
        "SELECT * REPLACE ('strange' AS object, 'inf'::DOUBLE AS x_m, -0.01 AS gap_m) "
        "FROM placed_objects",
    ),
    "grasps": (
        "SELECT * REPLACE (q - 2 AS q, NULL AS f_z, 'infeasible' AS status) FROM grasps",
        "SELECT * REPLACE (0.55 AS q, '-inf'::DOUBLE AS tau_z, 'test' AS split) FROM grasps",
    ),
    "samples": (
        "SELECT * FROM samples LIMIT 7",
        "SELECT * REPLACE ('one' AS object, CASE WHEN sample % 3 = 0 THEN NULL ELSE 2 * q END "
        "AS q) FROM samples",
    ),
    "epochs": ("SELECT * REPLACE (NULL AS val_mae, epoch / 10 AS train_mae) FROM epochs",),
    "attempts": (
        "SELECT * REPLACE ('failed' AS outcome, NULL AS cause) FROM attempts",
        "SELECT * REPLACE ('lifted' AS outcome, 0.001 AS lifted_height_m) FROM attempts",
        "SELECT * REPLACE ('a' AS scene, 'a' AS policy) FROM attempts UNION ALL "
        "SELECT * REPLACE ('b' AS scene, 'b' AS policy) FROM attempts",
    ),
    "inputs": ("SELECT * REPLACE ('another' AS present_sha256) FROM inputs",),
}


def declared(stage: str) -> list[Expectation]:
    """What every run expects of a stage."""
    mine = [one for one in declared_expectations() if one.stage in {stage, EVERY}]
    return [one.model_copy(update={"stage": stage}) for one in mine]


def by_duckdb(stage: str, made: Mapping[str, Path], cache: Path) -> list[Found]:
    """What DuckDB finds."""
    with query.open_tables(made, cache, stage) as tables:
        return [check(one, tables) for one in declared(stage)]


def by_sqlite(stage: str, made: Mapping[str, Path], cache: Path) -> list[Found]:
    """What SQLite finds."""
    questions = [one.sql for one in declared(stage)]
    with few_rows.few_rows(questions, stage, made, cache) as few:
        assert few is not None
        return [expectations.held(one, few.number(one.sql)) for one in declared(stage)]


def test_both_find_the_same_numbers_in_a_good_run(made: dict[str, Path], cache: Path) -> None:
    for stage in made:
        found = by_sqlite(stage, made, cache)
        assert found == by_duckdb(stage, made, cache)
        assert [one for one in found if one.value is not None]
        assert check_expectations(stage, (), made, cache) == found


def test_both_find_the_same_numbers_in_broken_rows_and_nothing_passes_them_all(
    made: dict[str, Path], cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    failed = set()
    for table, sql in ((table, sql) for table, several in BROKEN.items() for sql in several):
        with query.open_tables(made, cache) as tables:
            kept = table_rows(table, made, cache)
            assert kept is not None
            broken = tables.ask(sql).cast(kept.schema)

        def rows(
            name: str,
            made: Mapping[str, Path],
            cache: Path,
            makers: Sequence[str] | None = None,
            instead: tuple[str, pa.Table] = (table, broken),
        ) -> pa.Table | None:
            return instead[1] if name == instead[0] else table_rows(name, made, cache, makers)

        with monkeypatch.context() as patched:
            patched.setattr(few_rows, "table_rows", rows)
            patched.setattr(query, "table_rows", rows)
            for stage in made:
                if not any(table in one.sql for one in declared(stage)):
                    continue
                found = by_sqlite(stage, made, cache)
                assert found == by_duckdb(stage, made, cache), sql
                failed |= {one.expected.name for one in found if one.problem}
    assert failed == {one.name for one in declared_expectations()}


def test_many_rows_are_for_duckdb(
    made: dict[str, Path], cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = check_expectations("grasps", (), made, cache)
    monkeypatch.setattr(few_rows, "MOST_VALUES", 10)
    with few_rows.few_rows(["SELECT avg(q) FROM grasps"], "grasps", made, cache) as few:
        assert few is None
    assert check_expectations("grasps", (), made, cache) == expected


def test_what_cannot_be_read_is_told_of_each_question(made: dict[str, Path], cache: Path) -> None:
    without = {stage: path for stage, path in made.items() if stage != "grasps"}
    found = {one.expected.name: one for one in check_expectations("shards", (), without, cache)}
    assert found["no sample was lost or made up"].problem.startswith("cannot be asked")
    assert not found["labels of samples lie in [0, 1]"].problem


def test_an_answer_that_is_no_number_is_refused(made: dict[str, Path], cache: Path) -> None:
    questions = ["SELECT q FROM grasps", "SELECT nothing FROM grasps"]
    with few_rows.few_rows(questions, "grasps", made, cache) as few:
        assert few is not None
        for sql in questions:
            with pytest.raises(QueryError):
                few.number(sql)
