"""[folds]: cross-validation over families of objects, `make folds`."""

from pydantic import Field

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
    epochs: int = Field(6, ge=1, le=10_000, description="passes over the samples, in every fold")
    resamples: int = Field(
        2000, ge=100, le=1_000_000, description="bootstrap samples over objects, for intervals"
    )
