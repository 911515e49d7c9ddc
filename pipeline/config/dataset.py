"""[dataset]: texts for a run's report and dataset card; no result depends on them."""

from pydantic import Field

from pipeline.config.section import Section


class DatasetConfig(Section):
    """Texts of the dataset card."""

    title: str = Field("", description="name of the dataset; without it the run's")
    meshes: str = Field("", description="where the meshes are from and whom to cite for them")
    licence: str = Field(
        "", description="licence of the meshes; without it that of the mesh folder's own file"
    )
    version: str = Field(
        "1.0.0", pattern=r"^\d+\.\d+\.\d+$", description="of the dataset that is published"
    )
    preview_samples: int = Field(
        1000, ge=1, le=100_000, description="samples a split in a published dataset's preview"
    )
