"""[agreement]: the grasps on which the label is compared with the referee."""

from typing import Self

from pydantic import Field, model_validator

from pipeline.config.section import Section


class AgreementConfig(Section):
    """The scenes that `make referee` builds, and the grasps that it chooses from them."""

    clutters_per_level: int = Field(
        2, ge=1, description="clutters of test and training objects a level; half of val objects"
    )
    labelled: int = Field(9000, ge=1, description="grasps labelled, to choose from")
    grasps: int = Field(2400, ge=1, description="grasps judged, spread over q and objects")
    varied: int = Field(
        100, ge=0, description="of them, judged again with each figure halved and doubled"
    )
    fitted: int = Field(
        600, ge=10, description="other grasps that the label on measured clouds is fitted to"
    )
    shown: int = Field(30, ge=0, le=200, description="grasps in the recording; some 0.3 MB each")
    loads_n: tuple[float, ...] = Field(
        (0.5, 1.0, 2.0, 4.0, 8.0), min_length=1, description="weights to be borne, for AUROC [N]"
    )
    resamples: int = Field(400, ge=0, description="bootstrap samples over objects, for intervals")

    @model_validator(mode="after")
    def _fits_to_others(self) -> Self:
        if self.grasps + self.fitted > self.labelled:
            raise ValueError("labelled must be at least grasps + fitted")
        return self
