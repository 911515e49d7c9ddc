"""[store]: an object store in which a run lies, beside the folder of the machine that makes it."""

from pydantic import Field

from pipeline.config.section import Section


class StoreConfig(Section):
    """Where a run lies; no result depends on it."""

    url: str = Field(
        "",
        pattern=r"^$|^(s3|s3a|gs|az|abfs|abfss)://",
        description="object store and prefix, such as s3://bucket/prefix: the run lies below it, "
        "under its name; empty: in its folder alone. RUN_STORE in the environment stands before it",
    )
    cache_mib: int = Field(
        20480, ge=1, description="files of the run that a node keeps at once, at most [MiB]"
    )
    lease_s: float = Field(
        60.0,
        ge=3,
        le=3600,
        description="a machine that makes the run and is not heard of for so long is taken for "
        "dead, and another may go on [s]",
    )
    patience_s: float = Field(
        60.0, ge=0.1, le=3600, description="how long a request is tried again [s]"
    )
