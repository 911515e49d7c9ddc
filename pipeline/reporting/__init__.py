"""The report of a run: figures, tables and one page, from artifacts and summaries alone."""
