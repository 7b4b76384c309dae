"""``bench train`` from options to weights: settle the request, gather motion, run the loop."""

import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import torch

from retarget_bench.api import optional
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.header_builder import versions
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import checkpoint, joint_datasets, log, parallel, request, weights
from retarget_bench.training.card import UNKNOWN, UNPARTED, UNWATCHED, card
from retarget_bench.training.checkpoint import Checkpoint
from retarget_bench.training.config import Augmentation, Budget, TrainingConfig
from retarget_bench.training.contract import LearnsFromPairs
from retarget_bench.training.data import TrainingData, gather
from retarget_bench.training.loop import Loop, TrainingStatus
from retarget_bench.training.pair_data import gather_pairs
from retarget_bench.training.phases import set_deterministic
from retarget_bench.training.request import Request
from retarget_bench.training.settings import TrainingSettings
from retarget_bench.training.validate import Validator

FOLDER = Path("runs/train")
_OTHER_DATA = "{} is no longer the data that this run began with; train anew in another folder"
DRAWN = 120.0
"""Seconds between pictures of the curves."""


class TrainingOptions(TrainingSettings):
    """What is trained, and how. dataset: one, or several (``joint_datasets.py``). None: not given."""

    method: Spec | None = field(kw_only=False)
    dataset: Spec | None = field(kw_only=False)
    jobs: int = field(default=1)


class ProgressReporter(Protocol):
    """Callbacks that report a run's progress."""

    def say(self, text: str) -> None: ...
    def gathering(self, done: int, total: int) -> None: ...
    def loading(self, done: int, total: int) -> None: ...
    def began(self, asked: Request, at: Checkpoint) -> None: ...
    def show(self, status: TrainingStatus) -> None: ...


@dataclass(frozen=True)
class TrainingResult:
    """folder: with the weights. at: the last checkpoint. asked: what was trained."""

    folder: Path
    at: Checkpoint
    asked: Request


def train(asked: TrainingOptions, reporter: ProgressReporter) -> TrainingResult:
    """Train a method, or go on with it. Raises BenchError for whatever stands in the way."""
    device = parallel.device(asked.device)
    set_deterministic(device)
    parallel.join(device)
    try:
        with ExitStack() as held:  # in the first process the lock of the folder

            def begun() -> tuple[Path, Request]:
                held.enter_context(request.locked(folder_of(asked)))
                return _settled(asked)

            folder, wanted = parallel.first(begun)
            return _train(folder, wanted, asked, reporter, device)
    except torch.cuda.OutOfMemoryError as error:
        raise BenchError(
            f"{device} has not enough memory for this batch; spread it over more processes, or give the "
            "method a preset with a smaller one"
        ) from error
    finally:
        parallel.leave()


def finished(asked: TrainingOptions) -> bool:
    """True if the run that is asked to go on has used up its budget and its weights are there.

    Raises BenchError where its folder holds another run than the one that is asked for.
    """
    if asked.out is None or request.read(asked.out) is None:
        return False
    folder, wanted = _settled(asked)
    at = checkpoint.read(folder)
    ended = at is not None and wanted.limit.used(at.step, at.seconds) >= 1.0
    return ended and (folder / f"{weights.BEST}.json").exists()


def _train(
    folder: Path, wanted: Request, asked: TrainingOptions, reporter: ProgressReporter, device: torch.device
) -> TrainingResult:
    spec, data_spec = Spec.parse(wanted.method), Spec.parse(wanted.dataset)
    data, config = joint_datasets.dataset(data_spec), wanted.recipe
    gathering = _first_only(reporter.gathering)
    training_data = parallel.in_turn(
        lambda: (
            gather_pairs(data_spec, spec, config.fps, asked.jobs, gathering)
            if isinstance(bound.method(spec).built, LearnsFromPairs)
            else gather(data_spec, spec, config.fps, asked.jobs, gathering, config.augmentation)
        )
    )
    wanted = parallel.first(lambda: _with_motion(wanted, training_data))
    torch.manual_seed(wanted.seed)
    module = bound.method(spec).built.training_module(training_data, config)  # type: ignore[attr-defined]
    start = checkpoint.read(folder)
    if wanted.init and start is None:
        before = _initial_weights(spec, wanted.init_path)
        if before.hash != wanted.init:
            raise BenchError(
                f"{wanted.init_path}: these are no longer the weights that this run began with"
            )
        module.load(before.tensors)
    module.modules.to(device)
    validator = _validator(data, module, config.cases, device, reporter)
    drawn = time.perf_counter()

    def write(at: Checkpoint, tensors: Mapping[str, torch.Tensor]) -> None:
        """The best weights with their card; without validation the last ones."""
        weights.write(folder, weights.BEST, tensors, card(wanted, data, training_data, at, folder, device))

    def draw() -> None:
        log.draw(folder, f"{wanted.method} on {data.label.strip()}")

    def saved(at: Checkpoint, better: bool) -> None:
        nonlocal drawn
        if better:
            write(at, at.exported)
        if time.perf_counter() - drawn > DRAWN:
            draw()
            drawn = time.perf_counter()

    show = _first_only(reporter.show)
    workers = asked.jobs if device.type == "cuda" else 0
    loop = Loop(module, config, wanted.limit, wanted.seed, device, folder, validator, show, saved, workers)
    if parallel.rank() == 0:
        request.write(folder, replace(wanted, job=parallel.job()))
        for note in training_data.notes:
            reporter.say(note)
        if start is None:
            reporter.say(_amount(training_data, config))
        if wanted.processes != parallel.world():
            reporter.say(f"this run began with {wanted.processes} processes; its batches are now others")
        reporter.began(wanted, start or Checkpoint(0, 0.0, {}))
    at = loop.run(start)
    if parallel.rank() == 0:
        write(at, at.exported if at.best else loop.export())
        draw()
    return TrainingResult(folder, at, wanted)


def _first_only(call: Callable[..., Any]) -> Callable[..., Any]:
    """The call in the first process, nothing in the others."""
    return call if parallel.rank() == 0 else lambda *_: None


def _validator(
    data: Any, module: Any, cases: int, device: torch.device, reporter: ProgressReporter
) -> Validator | None:
    """For the first process; None where there is nothing to validate on."""
    if parallel.rank() > 0:
        return None
    why = UNPARTED
    if (aside := optional.validation(data)) is not None:
        if validator := Validator(aside, module.method(), cases, device, reporter.loading):
            return validator
        why = "the method supports no validation case that has a right answer"
    reporter.say(f"{why}: {UNWATCHED}")
    return None


# -------------------------------------------------------------------------------------- what is asked
def folder_of(asked: TrainingOptions) -> Path:
    """The folder of a run. Raises BenchError where nothing says so."""
    if asked.out is not None:
        return asked.out
    if asked.method is None:
        raise BenchError("say which METHOD to train, or which run to go on with: --resume --out DIR")
    return FOLDER / registry.canonical("methods", asked.method).slug


def _settled(asked: TrainingOptions) -> tuple[Path, Request]:
    """The folder, and the run that it holds or will hold. Raises BenchError."""
    method = registry.canonical("methods", asked.method) if asked.method else None
    folder = folder_of(asked)
    kept = request.read(folder)
    again = kept is not None and parallel.restarted() and kept.job == parallel.job()
    if kept is not None and not asked.resume and not again:
        raise BenchError(
            f"{folder} already holds a run ({kept.command}); go on with it by --resume, or give "
            "another --out"
        )
    if kept is not None:
        return folder, _same(kept, asked, method)
    if method is None:
        raise BenchError(f"{folder} holds no run to go on with; bench train METHOD begins one")
    if asked.resume and asked.dataset is None:
        raise BenchError(f"{folder} holds no run to go on with; with -d DATASET one begins")
    return folder, _new(asked, method)


def _same(kept: Request, asked: TrainingOptions, method: Spec | None) -> Request:
    """The run, with its data where they lie now. Raises BenchError where it cannot go on as it began."""
    given = {"method": method and str(method), "preset": asked.preset, "seed": asked.seed}
    given |= {"budget": asked.budget, "precision": asked.precision, "augment": asked.augment or None}
    request.contradicted(kept, given)
    if asked.dataset is not None:
        data = str(joint_datasets.canonical(asked.dataset))
        if request.without_places(data) != request.without_places(kept.dataset):
            request.contradicted(kept, {"dataset": data})
        kept = replace(kept, dataset=data)
    spec = Spec.parse(kept.method)
    built = _trainable(spec)
    version = str(built.card.version)
    if (version, dict(built.facts())) != (kept.version, dict(kept.facts)):
        raise BenchError(
            f"{kept.method} is not what this run began with (version {kept.version}, now {version}, or "
            "other parameters); train anew in another folder"
        )
    if asked.init is not None:
        request.contradicted(kept, {"init": _initial_weights(spec, asked.init).hash})
    if joint_datasets.dataset(Spec.parse(kept.dataset)).content != kept.content:
        raise BenchError(_OTHER_DATA.format(kept.dataset))
    return kept


def _with_motion(wanted: Request, training_data: TrainingData) -> Request:
    """The run with its motion's hash. Raises BenchError where it began with other motion."""
    if wanted.motion not in ("", training_data.hash):
        raise BenchError(_OTHER_DATA.format(wanted.dataset))
    return replace(wanted, motion=training_data.hash)


def _new(asked: TrainingOptions, method: Spec) -> Request:
    if asked.dataset is None:
        raise BenchError("say what to train on: -d DATASET")
    data_spec = joint_datasets.canonical(asked.dataset)
    built, data = _trainable(method), joint_datasets.dataset(data_spec)
    name = asked.preset or "default"
    if name not in built.presets:
        raise BenchError(f"{method.name} has no preset {name!r}; there are {', '.join(built.presets)}")
    config: TrainingConfig = built.presets[name]
    if asked.budget and (limit := Budget.parse(asked.budget)).steps:
        config = replace(config, steps=limit.steps)
    config = replace(config, precision=asked.precision or config.precision)
    if asked.augment:
        config = replace(config, augmentation=_augmentation(method, built, config))
    before = _initial_weights(method, asked.init).card if asked.init else {}
    seen = before.get("training_manifest") or {}
    return Request(
        method=str(method),
        dataset=str(data_spec),
        preset=name,
        budget=asked.budget or "",
        seed=asked.seed or 0,
        recipe=config,
        version=str(built.card.version),
        facts=dict(built.facts()),
        label=data.label,
        content=data.content,
        init=str(before.get("hash", "")),
        init_path=asked.init or "",
        seen=seen,
        seen_all=bool(seen) and UNKNOWN not in before.get("notes", ()),
        processes=parallel.world(),
        versions=versions(),
    )


def _augmentation(method: Spec, built: Any, config: TrainingConfig) -> Augmentation:
    """Raises BenchError where there are no windows of single motions that could be changed."""
    if isinstance(built, LearnsFromPairs):
        raise BenchError(f"{method.name} learns from pairs, and --augment makes no pair of a pair")
    if config.window == 1:
        raise BenchError(f"{method.name} learns from single frames, and --augment changes windows")
    return config.augmentation or Augmentation()


def _amount(training_data: TrainingData, config: TrainingConfig) -> str:
    """The amount of training motion, as a sentence: with a few minutes of motion people have forgotten a
    parameter of the data set, and clips that are shorter than a window are mostly padding."""
    clips = [clip for mine in training_data.clips.values() for clip in mine]
    bodies = len(training_data.clips)
    minutes = training_data.frames / config.fps / 60
    by = f"{len(clips)} clips of {bodies} character{'s' * (bodies != 1)}"
    short = sum(clip.frames < config.window for clip in clips)
    padded = f", {short} of them shorter than a window ({config.window} frames) and padded" if short else ""
    return f"training on {minutes:.0f} minutes of motion: {by}{padded}"


def _trainable(spec: Spec) -> Any:
    """A method by its spec. Raises BenchError where it cannot be trained."""
    if spec.posts:
        raise BenchError(f"{spec}: post-processors learn nothing; train {spec.alone}")
    built = bound.method(spec).built
    if not all(hasattr(built, name) for name in ("presets", "prepare", "training_module")):
        raise BenchError(f"{spec.name} has nothing to train; bench info {spec.name} says what it is")
    return built


def _initial_weights(spec: Spec, given: str) -> weights.Bundle:
    """Weights to begin with: the name of shipped ones, or a path. Raises BenchError."""
    built = _trainable(spec)
    shipped: Mapping[str, Path] = getattr(built, "shipped", dict)()
    version, facts = str(built.card.version), dict(built.facts())
    return weights.read(shipped.get(given, given), method=spec.name, version=version, facts=facts)
