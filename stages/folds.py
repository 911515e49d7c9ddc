"""`make folds`: cross-validation over families, so that every object is tested once.

In ``runs/<run>/folds``: the objects of the run, dealt to folds by family; ``fold-<k>`` with the
clutters and grasps of one fold's objects alone; a network for each fold, trained on the others and
measured after each epoch on the next; folds.summary.json and .md. Embedded objects beside meshes
are dealt too and never tested on. A fold that was tested is kept in ``fold-<k>/tested.json`` until
its grasps, configuration or code change: what was stopped goes on at the next fold.

With ``folds.start`` every fold begins with the network of a run that held out all meshes;
with ``folds.trained = false`` too, that network is tested on every fold as it is.
"""

import hashlib
import json
import sys
import time
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from loguru import logger

from pipeline.artifacts import ArtifactWriter, publish_bytes, read_provenance
from pipeline.artifacts.named_inputs import named_networks
from pipeline.config import RunConfig, load_run_config
from pipeline.config.judged import folds_config
from pipeline.config.learning import TrainConfig
from pipeline.config.written import as_toml
from pipeline.errors import ArtifactError, ConfigError
from pipeline.execution import RunFolder, generator, run_command
from pipeline.execution.code import code_digests
from pipeline.geometry.folds import check_held_out, deal_families
from pipeline.geometry.parametric import PARAMETRIC_OBJECTS
from pipeline.messages.objects import TOPIC, object_message, read_objects
from pipeline.messages.training import CHECKPOINT
from pipeline.network.checkpoint import checkpoint_digest
from pipeline.network.fine_tuning import starting_network
from pipeline.network.folds import TestedFold, figures_of_folds, train_and_test
from pipeline.network.ga_cnn import GaCnn
from pipeline.network.released_files import RELEASED
from pipeline.reporting.folds import as_markdown
from stages.graph import RUNS_DIR, starting_run
from stages.holdout import labelled
from stages.train import print_epoch

NAME = "folds"
TESTED, TRAINED_BY = "tested.json", "pipeline.network.folds"
FOLDS = 5  # a fifth of the families is tested on at a time; what make passes in FOLDS wins
FEWEST_FOLDS = 3  # one to test on, one to choose the epoch on, one to train on
app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
RunName = Annotated[str, typer.Option(envvar="RUN", help="name of the run")]
RunsDir = Annotated[Path, typer.Option(help="folder of all runs")]
Folds = Annotated[int, typer.Option(envvar="FOLDS", min=FEWEST_FOLDS, help="how many folds")]


def fold_folder(folder: RunFolder, fold: int) -> RunFolder:
    """The run of one fold's clutters and grasps."""
    return RunFolder(folder.path / f"fold-{fold}")


@app.command()
def prepare(run: RunName = "default", folds: Folds = FOLDS, runs_dir: RunsDir = RUNS_DIR) -> None:
    """Write the run.toml of the objects that are dealt."""
    own = RunFolder(runs_dir / run).config
    config = folds_config(load_run_config(own) if own.is_file() else RunConfig(), folds)
    publish_bytes(RunFolder(runs_dir / run / NAME).config, as_toml(config).encode())


@app.command()
def deal(run: RunName = "default", folds: Folds = FOLDS, runs_dir: RunsDir = RUNS_DIR) -> None:
    """Give each fold a run of its own, with its objects alone."""
    folder = RunFolder(runs_dir / run / NAME)
    objects = {name: item for name, (item, _) in read_objects(folder.artifact("objects")).items()}
    families = {name: item.family for name, item in objects.items()}
    classes = {name: item.shape_class for name, item in objects.items()}
    seed = load_run_config(folder.config).seed
    fold_of = deal_families(families, classes, tested(objects), folds, seed)
    made_from = read_provenance(folder.artifact("objects"))
    for fold in range(folds):
        own = fold_folder(folder, fold)
        publish_bytes(own.config, folder.config.read_bytes())
        key = f"{made_from.key}, fold {fold} of {folds}"
        with ArtifactWriter(own.artifact("objects"), replace(made_from, key=key)) as artifact:
            taken = [name for name in objects if fold_of[name] == fold]
            for index, name in enumerate(taken):
                artifact.write(TOPIC, object_message(objects[name], "test"), log_time_ns=index)
        logger.info("folds: fold {} holds {}", fold, ", ".join(taken))


def tested(names: Collection[str]) -> set[str]:
    """The meshes; the embedded objects where there is no mesh."""
    return {name for name in names if name not in PARAMETRIC_OBJECTS} or set(names)


@app.command()
def measure(run: RunName = "default", folds: Folds = FOLDS, runs_dir: RunsDir = RUNS_DIR) -> None:
    """Train a network for each fold and test it there."""
    began = time.perf_counter()
    folder = RunFolder(runs_dir / run / NAME)
    config = load_run_config(folder.config)
    objects = read_objects(folder.artifact("objects"))
    families = {name: item.family for name, (item, _) in objects.items()}
    parts = [labelled(fold_folder(folder, fold)) for fold in range(folds)]
    contents = {name: objects[name][0].content for name in tested(objects)}
    start = starting(config, contents, runs_dir)
    done = []
    for fold in range(folds):
        logger.info("folds: fold {} of {}", fold, folds)
        own, key = fold_folder(folder, fold), key_of(folder, fold, folds, start)
        if (kept := read_kept(own, key)) is None:
            state = own.state("train")
            kept = train_and_test(config, parts, fold, tested(objects), state, print_epoch, start)
            text = json.dumps({"key": key, "tested": kept.to_json()})
            publish_bytes(own.path / TESTED, text.encode())
        done.append(kept)
    rng = generator(config.seed, NAME)
    figures = figures_of_folds(done, families, config.folds.resamples, rng) | {
        "layers": config.network.layers,
        "start": config.folds.start,
        "trained": config.folds.trained,
        "wall_time_s": time.perf_counter() - began,
    }
    text, summary = as_markdown(figures), json.dumps(figures, indent=1) + "\n"
    publish_bytes(folder.summary(NAME), summary.encode())
    publish_bytes(folder.path / f"{NAME}.md", text.encode())
    sys.stdout.write(text)


def starting(config: RunConfig, contents: Mapping[str, str], runs_dir: Path) -> GaCnn | None:
    """The network of the run that ``folds.start`` names, which learned from none of these objects.

    contents: name and content of each object that is tested.
    """
    if not config.folds.start:
        return None
    run = RunFolder(runs_dir / config.folds.start)
    for behind in runs_behind(run):
        known = read_objects(behind.artifact("objects")).values()
        check_held_out(contents, {item.content: split for item, split in known}, behind.path.name)
    path = run.path / "train" / CHECKPOINT
    if not path.is_file():
        raise ArtifactError(
            f"{path} is missing, and folds.start names its run",
            f"Train it: make train RUN={config.folds.start}",
        )
    seed = config.seed if config.folds.trained else None  # nothing would train further layers
    return starting_network(path.read_bytes(), str(path), config.network, seed)


def runs_behind(run: RunFolder) -> list[RunFolder]:
    """All runs whose samples a run's network learned from.

    The run itself and those that its train.further_runs names; then the same of the runs whose
    networks its train.start and train.teachers name, and so on back.
    """
    found: dict[Path, RunFolder] = {}
    followed: set[Path] = set()
    todo = [run]
    while todo:
        run = todo.pop()
        if run.path.resolve() in followed:
            continue
        followed.add(run.path.resolve())
        found[run.path.resolve()] = run
        wanted = load_run_config(run.config).train if run.config.is_file() else TrainConfig()
        begun = [(one, starting_run(run, one)) for one in named_networks(wanted).values()]
        further = [(one, RunFolder(run.path / one)) for one in wanted.further_runs]
        for named, behind in begun + further:
            if named == RELEASED or not behind.artifact("objects").is_file():
                raise ConfigError(
                    f"Run {run.path.name} learned from {named}, and which objects that knows is "
                    "not recorded",
                    "Let [train] name networks of runs, and runs, whose objects.mcap is there",
                )
        todo += [behind for _, behind in begun]
        found |= {behind.path.resolve(): behind for _, behind in further}
    return list(found.values())


def key_of(folder: RunFolder, fold: int, folds: int, start: GaCnn | None) -> str:
    """What the test of a fold depends on: all grasps, configuration, code and first weights."""
    begun = checkpoint_digest(start) if start else None
    made = [read_provenance(fold_folder(folder, k).artifact("grasps")).key for k in range(folds)]
    text = json.dumps([fold, made, folder.config.read_text(), code_digests(TRAINED_BY), begun])
    return hashlib.sha256(text.encode()).hexdigest()


def read_kept(folder: RunFolder, key: str) -> TestedFold | None:
    """The test of a fold as it was kept; None where there is none with this key."""
    path = folder.path / TESTED
    if not path.is_file():
        return None
    found = json.loads(path.read_text())
    return TestedFold.from_json(found["tested"]) if found["key"] == key else None


if __name__ == "__main__":
    run_command(app)
