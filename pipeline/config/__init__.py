"""One frozen, validated tree of every number a run depends on."""

from pipeline.config.cameras import (
    CamerasConfig,
    DepthSensor,
    StaticCameraConfig,
    WristCameraConfig,
)
from pipeline.config.evaluation import (
    EvaluateConfig,
    LiftConfig,
    RecordingConfig,
    SuctionConfig,
)
from pipeline.config.grasps import GraspsConfig, GripperConfig, PadConfig, SensingConfig
from pipeline.config.learning import NetworkConfig, ShardsConfig, SweepConfig, TrainConfig
from pipeline.config.objects import ConvexPartsConfig, ObjectsConfig, SplitConfig
from pipeline.config.policy import PolicyConfig
from pipeline.config.referee import RefereeConfig
from pipeline.config.scenes import ClutterCounts, ScenesConfig
from pipeline.config.tree import RunConfig, load_run_config, section_digest

__all__ = [
    "CamerasConfig",
    "ClutterCounts",
    "ConvexPartsConfig",
    "DepthSensor",
    "EvaluateConfig",
    "GraspsConfig",
    "GripperConfig",
    "LiftConfig",
    "NetworkConfig",
    "ObjectsConfig",
    "PadConfig",
    "PolicyConfig",
    "RecordingConfig",
    "RefereeConfig",
    "RunConfig",
    "ScenesConfig",
    "SensingConfig",
    "ShardsConfig",
    "SplitConfig",
    "StaticCameraConfig",
    "SuctionConfig",
    "SweepConfig",
    "TrainConfig",
    "WristCameraConfig",
    "load_run_config",
    "section_digest",
]
