"""Running stages: work items in order, seeds, progress, freshness, resuming."""

from pipeline.execution.commands import run_command
from pipeline.execution.executors import run_in_order
from pipeline.execution.isolated import Allowance, Isolation, Lost
from pipeline.execution.running import Summary, stage_command
from pipeline.execution.seeds import derive_seed, generator
from pipeline.execution.stage import RunFolder, Stage, StageContext
from pipeline.progress import progress

__all__ = [
    "Allowance",
    "Isolation",
    "Lost",
    "RunFolder",
    "Stage",
    "StageContext",
    "Summary",
    "derive_seed",
    "generator",
    "progress",
    "run_command",
    "run_in_order",
    "stage_command",
]
