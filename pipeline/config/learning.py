"""[shards], [network] and [train]: dataset files, GA-CNN and its training."""

from typing import Literal

from pydantic import Field

from pipeline.config.section import Section


class ShardsConfig(Section):
    """Shuffled, split shards."""

    samples_per_shard: int = Field(8192, ge=16, description="samples in one file")
    samples_per_message: int = Field(256, ge=1, le=8192, description="samples in one message")
    compression: Literal["zstd", "lz4", "none"] = "zstd"


class NetworkConfig(Section):
    """GA-CNN: a two-layer stem and four attention stages; Supplement IV."""

    layers: int = Field(18, ge=18, le=102, description="weighted layers; Supplement IV: 52")
    channels: tuple[int, int, int, int] = Field(
        (16, 32, 64, 128), description="channels of the four stages; IV: 64-128-256-512"
    )
    attention: Literal["cbam", "none"] = Field("cbam", description="'none' is the ablation")


class TrainConfig(Section):
    """Optimisation of GA-CNN."""

    epochs: int = Field(20, ge=1, le=10_000)
    batch_size: int = Field(128, ge=2, le=65536)
    learning_rate: float = Field(2e-3, gt=0, le=1)
    weight_decay: float = Field(0.02, ge=0, le=1)
    warmup_fraction: float = Field(0.1, ge=0, lt=1, description="share of steps with rising rate")
    patience_epochs: int = Field(8, ge=1, description="stop after so many epochs without gain")
    augment: bool = Field(True, description="turn and mirror clouds about the approach axis")
    threads: int = Field(2, ge=1, le=256, description="CPU threads; part of the run's identity")
    device: Literal["auto", "cpu", "cuda"] = "auto"
