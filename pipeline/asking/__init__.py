"""Questions about a run in SQL: artifacts as tables, asked by DuckDB."""
