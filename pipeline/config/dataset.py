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
