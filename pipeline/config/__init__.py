"""One frozen, validated tree of every number a run depends on."""

from pipeline.config.evaluation import (
    EvaluateConfig,
    LiftConfig,
    PolicyConfig,
    RecordingConfig,
    SuctionConfig,
)
from pipeline.config.grasps import GraspsConfig, GripperConfig, PadConfig, SensingConfig
from pipeline.config.learning import NetworkConfig, ShardsConfig, TrainConfig
from pipeline.config.objects import ConvexPartsConfig, ObjectsConfig, SplitConfig
from pipeline.config.scenes import CameraConfig, ClutterCounts, ScenesConfig
from pipeline.config.tree import RunConfig, load_run_config, section_digest

__all__ = [
    "CameraConfig",
    "ClutterCounts",
    "ConvexPartsConfig",
    "EvaluateConfig",
    "GraspsConfig",
    "GripperConfig",
    "LiftConfig",
    "NetworkConfig",
    "ObjectsConfig",
    "PadConfig",
    "PolicyConfig",
    "RecordingConfig",
    "RunConfig",
    "ScenesConfig",
    "SensingConfig",
    "ShardsConfig",
    "SplitConfig",
    "SuctionConfig",
    "TrainConfig",
    "load_run_config",
    "section_digest",
]
