"""[folds]: cross-validation over families of objects, `make folds`."""

from typing import Self

from pydantic import Field, model_validator

from pipeline.config.learning import NetworkConfig
from pipeline.config.section import Section


class FoldsConfig(Section):
    """Clutters and labels of every fold, and the network that is trained for each."""

    clutters_per_level: int = Field(4, ge=1, description="clutters a level of each fold's objects")
    labelled: int = Field(100_000, ge=1, description="grasps labelled, over all folds")
    network: NetworkConfig = NetworkConfig()
    start: str = Field(
        "",
        description="run whose network each fold's training begins with: it must have held out "
        "every mesh; without, weights are drawn from the seed",
    )
    trained: bool = Field(
        True, description="false: the network of [start] is tested on every fold as it is"
    )
    epochs: int = Field(6, ge=1, le=10_000, description="passes over the samples, in every fold")
    resamples: int = Field(
        2000, ge=100, le=1_000_000, description="bootstrap samples over objects, for intervals"
    )

    @model_validator(mode="after")
    def _something_to_test(self) -> Self:
        if not self.trained and not self.start:
            raise ValueError("trained = false tests the network of the run that start names")
        return self
