"""[[expect]]: what must hold of an artifact, asked in SQL of its tables (schemas/TABLES.md)."""

from typing import Literal, Self

from pydantic import Field, model_validator

from pipeline.config.section import Section

EVERY = "every"  # as a stage
StageName = Literal["every", "objects", "scenes", "grasps", "shards", "train", "evaluate"]
Severity = Literal["error", "warning"]


class Expectation(Section):
    """One number, asked in SQL, that must lie within bounds."""

    name: str = Field(min_length=1, description="what must hold, in words")
    stage: StageName = Field(description="at whose end it is checked; every: at the end of each")
    sql: str = Field(min_length=1, description="a question whose answer is one number")
    at_least: float | None = Field(None, description="least value that is well; none: no bound")
    at_most: float | None = Field(None, description="greatest value that is well; none: no bound")
    severity: Severity = Field(
        "error", description="an error makes `make expect` fail, a warning is told alone"
    )
    reason: str = Field(min_length=1, description="why it must hold, and what breaks where not")

    @model_validator(mode="after")
    def _has_a_bound(self) -> Self:
        if self.at_least is None and self.at_most is None:
            raise ValueError("give at_least, at_most or both")
        return self
