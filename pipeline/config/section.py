"""What all configuration sections share: frozen, bounded, no unknown keys."""

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """One table of run.toml. Every field states unit, bound and source."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
