"""[shards], [network], [train], [loading], [sweep]: files, GA-CNN, its training, its family."""

from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from pipeline.config.section import Section

SHALLOWEST, DEEPEST = 18, 102  # Supplement IV: depths of the family
LAYERS_PER_BLOCK = 2  # weighted layers of a residual block: so every depth is even
# Of the grouped convolutions: sixteen fill one vector register of single precision, and bring the
# network of Supplement IV to its 3.23 M parameters.
CHANNELS_PER_GROUP = 16


def is_family_depth(layers: int) -> bool:
    """Whether GA-CNN has a member of so many weighted layers: an even number from 18 to 102."""
    return layers % LAYERS_PER_BLOCK == 0 and SHALLOWEST <= layers <= DEEPEST


def _of_the_family(layers: int) -> int:
    if not is_family_depth(layers):
        raise ValueError(
            f"{layers} is no depth of the GA-CNN family: an even number from {SHALLOWEST} to "
            f"{DEEPEST}"
        )
    return layers


def _that_groups_divide(channels: int) -> int:
    if channels > CHANNELS_PER_GROUP and channels % CHANNELS_PER_GROUP:
        raise ValueError(
            f"{channels} channels cannot be grouped: multiples of {CHANNELS_PER_GROUP} can, and "
            "smaller numbers"
        )
    return channels


Layers = Annotated[int, AfterValidator(_of_the_family)]
_TimedBatch = Annotated[int, Field(ge=1, le=65536)]
_Channels = Annotated[int, Field(ge=2, le=8192), AfterValidator(_that_groups_divide)]
StageChannels = tuple[_Channels, _Channels, _Channels, _Channels]


class ShardsConfig(Section):
    """Shuffled, split shards."""

    samples_per_shard: int = Field(8192, ge=16, description="samples in one file")
    samples_per_message: int = Field(256, ge=1, le=8192, description="samples in one message")
    samples_per_part: int = Field(
        65536,
        ge=16,
        le=2**20,
        description="about as many samples are shuffled in memory at once, 4 KB each; more are "
        "shuffled in two passes over the disk",
    )
    compression: Literal["zstd", "lz4", "none"] = "zstd"


Precision = Literal["auto", "single", "mixed"]  # what a step of training is computed in


class NetworkConfig(Section):
    """GA-CNN: a two-layer stem and four attention stages; Supplement IV."""

    layers: Layers = Field(18, description="weighted layers; Supplement IV: 52")
    channels: StageChannels = Field(
        (16, 32, 64, 128), description="channels of the four stages; IV: 64-128-256-512"
    )
    attention: Literal["cbam", "none"] = Field("cbam", description="'none' is the ablation")


class TrainConfig(Section):
    """Optimisation of GA-CNN."""

    epochs: int = Field(30, ge=1, le=10_000, description="passes over the training samples")
    batch_size: int = Field(128, ge=2, le=65536, description="samples in one step")
    shuffle_window: int = Field(
        0,
        ge=0,
        description="an epoch's order is drawn among so many neighbouring samples at a time, and "
        "no more need to be decoded at once; 0: among all",
    )
    learning_rate: float = Field(2e-3, gt=0, le=1, description="highest rate of the schedule")
    weight_decay: float = Field(0.02, ge=0, le=1, description="of AdamW; not on norms and biases")
    warmup_fraction: float = Field(0.1, ge=0, lt=1, description="share of steps with rising rate")
    loss_beta: float = Field(
        0.02, gt=0, le=1, description="error in q up to which the loss is square, then absolute"
    )
    gradient_norm_max: float = Field(1.0, gt=0, le=1e6, description="longer gradients are cut")
    keep: Literal["last", "best"] = Field(
        "last",
        description="epoch whose weights become the network: the last one, when the rate has "
        "fallen to zero, or that of least error on val, a choice by chance where objects are few",
    )
    patience_epochs: int = Field(
        15, ge=1, description="with keep = 'best': stop after so many epochs without gain"
    )
    start: str = Field(
        "",
        description="weights to begin with: 'released', or a .safetensors file beside run.toml; "
        "with more layers than its network has, those are added to it; without, weights are drawn "
        "from the seed",
    )
    start_shares: tuple[Annotated[float, Field(ge=0, lt=1)], ...] = Field(
        (0.0,),
        min_length=1,
        description="with start: shares of the weights begun with to mix into those trained; the "
        "network is that of least error on val [1]",
    )
    teachers: tuple[str, ...] = Field(
        (),
        description="networks, each 'released' or a .safetensors file beside run.toml, whose mean "
        "prediction of each cloud is learnt beside its label",
    )
    teacher_share: float = Field(
        0.7,
        ge=0,
        le=1,
        description="weight of the teachers in the loss; the label has the rest [1]",
    )
    further_runs: tuple[str, ...] = Field(
        (),
        description="folders of other runs, beside run.toml: their training samples are learnt "
        "from too",
    )
    attempts: tuple[str, ...] = Field(
        (),
        description="files of logged attempts, or folders of them, beside run.toml: what they "
        "lifted and what not is trained on too",
    )
    attempt_repeats: int = Field(
        1, ge=1, le=10_000, description="how often each tried contact counts among the samples"
    )
    attempt_good_quality: float = Field(
        0.5,
        gt=0,
        lt=1,
        description="a contact that lifted is labelled by the mean q of training samples from "
        "this q on, one that did not by the mean of the others [1]",
    )
    augment: bool = Field(True, description="turn and mirror clouds about the approach axis")
    baseline_samples: int = Field(
        400,
        ge=16,
        description="training samples that the analytic baseline is fitted to, for the comparison",
    )
    timed_batches: tuple[_TimedBatch, ...] = Field(
        (1, 64, 512),
        min_length=1,
        description="batch sizes whose time a grasp the summary tells: one, a control step, a bulk",
    )
    threads: int = Field(2, ge=1, le=256, description="CPU threads; part of the run's identity")
    device: Literal["auto", "cpu", "cuda"] = Field(
        "auto", description="'auto' takes a GPU where there is one"
    )
    precision: Precision = Field(
        "auto",
        description="of the steps: 'mixed' takes bfloat16 where its few digits are enough, for "
        "more samples a second on processors that have it; 'auto' takes it on a GPU",
    )
    compiled: bool = Field(
        False,
        description="PyTorch compiles the network first, for more samples a second; it takes a "
        "minute and a C++ compiler, and one process trains",
    )

    @model_validator(mode="after")
    def _something_to_mix(self) -> Self:
        if any(self.start_shares) and not self.start:
            raise ValueError("start_shares mixes in the weights of the network that start names")
        return self

    @model_validator(mode="after")
    def _windows_stand_alone(self) -> Self:
        if self.shuffle_window and (self.attempts or self.further_runs):
            raise ValueError(
                "attempts and further_runs need every sample at once: set shuffle_window = 0, or "
                "leave them out"
            )
        return self


class LoadingConfig(Section):
    """What training may take of the disk; no result depends on it."""

    cache_mib: int = Field(
        32768, ge=1, description="decoded samples kept in the run's state at once, at most [MiB]"
    )


class SweepConfig(Section):
    """Comparison of the network family (Fig. 1), and of networks without attention or symmetry."""

    depths: tuple[Layers, ...] = Field(
        (18, 24, 30, 38, 44, 52, 58, 66, 72, 80, 86, 94, 102),
        min_length=1,
        description="weighted layers; IV: from 18 to 102",
    )
    channels: tuple[StageChannels, ...] = Field(
        ((8, 16, 32, 64), (16, 32, 64, 128), (32, 64, 128, 256), (64, 128, 256, 512)),
        min_length=1,
        description="channel sets; IV: four, of which 64-128-256-512 was chosen",
    )
    seeds: int = Field(
        3,
        ge=1,
        description="trainings of some of the family, which tell what chance alone changes; 1: "
        "every network is trained once",
    )
    seeded_every: int = Field(
        4, ge=1, description="of the family, every so many networks are trained with all seeds"
    )
    ablation_seeds: int = Field(
        3, ge=0, description="trainings of the run's network with, and without each of its parts"
    )
    samples: int = Field(8192, ge=16, description="training samples, the first of their split")
    held_out_samples: int = Field(4096, ge=16, description="of the val and of the test split, each")
    epochs: int = Field(6, ge=1, le=10_000, description="passes over the samples")
    batch_size: int = Field(128, ge=2, le=65536, description="samples in one step")
