"""``bench train`` from options to weights: settle the request, gather motion, run the loop."""

import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import torch

from retarget_bench.api import Dataset
from retarget_bench.api.completing import complete
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.header_builder import versions
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import checkpoint, joint_datasets, log, parallel, request, weights
from retarget_bench.training.card import UNKNOWN, UNPARTED, UNWATCHED, card
from retarget_bench.training.checkpoint import Checkpoint
from retarget_bench.training.config import Augmentation, Budget, TrainingConfig, presets
from retarget_bench.training.data import TrainingData, gather
from retarget_bench.training.loop import LEAST, Loop, TrainingStatus
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
    """Options of a training. dataset: one, or several (``joint_datasets.py``). None: not given."""

    method: Spec | None = field(kw_only=False)
    dataset: Spec | None = field(kw_only=False)
    jobs: int = field(default=1)


class ProgressReporter(Protocol):
    """Callbacks that report a run's progress."""

    def say(self, text: str) -> None: ...
    def gathering(self, done: int, total: int) -> None: ...
    def loading(self, done: int, total: int) -> None: ...
    def began(self, run: Request, at: Checkpoint) -> None: ...
    def show(self, status: TrainingStatus) -> None: ...


@dataclass(frozen=True)
class TrainingResult:
    """folder: with the weights. at: the last checkpoint. run: the run that was trained."""

    folder: Path
    at: Checkpoint
    run: Request


def train(
    options: TrainingOptions, reporter: ProgressReporter, begun: float | None = None
) -> TrainingResult:
    """Train a method, or go on with it. Raises BenchError for whatever stands in the way.

    begun: when the command began, by ``perf_counter``, which a budget of time counts from; None: now."""
    begun = time.perf_counter() if begun is None else begun
    if options.tensorboard:
        log.summary_writer()  # says that it is missing before there is a run
    device = parallel.device(options.device)
    set_deterministic(device)
    parallel.join(device)
    try:
        with ExitStack() as held:  # in the first process the lock of the folder

            def settled() -> tuple[Path, Request]:
                held.enter_context(request.locked(folder_of(options)))
                return _settled(options)

            folder, run = parallel.first(settled)
            return _train(folder, run, options, reporter, device, begun)
    except torch.cuda.OutOfMemoryError as error:
        raise BenchError(
            f"{device} has not enough memory for this batch; spread it over more processes, or give the "
            "method a preset with a smaller one"
        ) from error
    finally:
        parallel.leave()


def finished(options: TrainingOptions) -> bool:
    """True if the run that is to go on has used up its budget and its weights are there.

    Raises BenchError where its folder holds another run than the options name.
    """
    if options.out is None or request.read(options.out) is None:
        return False
    folder, run = _settled(options)
    at = checkpoint.read(folder)
    ended = at is not None and run.limit.used(at.step, at.seconds) >= 1.0
    return ended and (folder / f"{weights.BEST}.json").exists()


def _train(
    folder: Path,
    run: Request,
    options: TrainingOptions,
    reporter: ProgressReporter,
    device: torch.device,
    begun: float,
) -> TrainingResult:
    spec, data_spec = Spec.parse(run.method), Spec.parse(run.dataset)
    data, config = joint_datasets.dataset(data_spec), run.recipe
    gathering = _first_only(reporter.gathering)
    training_data = parallel.in_turn(
        lambda: (
            gather_pairs(data_spec, spec, config.fps, options.jobs, gathering)
            if bound.method(spec).built.from_pairs
            else gather(data_spec, spec, config.fps, options.jobs, gathering, config.augmentation)
        )
    )
    run = parallel.first(lambda: _with_motion(run, training_data))
    torch.manual_seed(run.seed)
    module = bound.method(spec).built.training_module(training_data, config)  # type: ignore[attr-defined]
    start = checkpoint.read(folder)
    if run.init and start is None:
        before = _initial_weights(spec, run.init_path)
        if before.hash != run.init:
            raise BenchError(f"{run.init_path}: these are no longer the weights that this run began with")
        module.load(before.tensors)
    module.modules.to(device)
    left = max(0.0, run.limit.seconds - (start.seconds if start else 0.0))
    validator = _validator(data, module, config.cases, left * LEAST, device, reporter)
    drawn = time.perf_counter()

    def write(at: Checkpoint, tensors: Mapping[str, torch.Tensor]) -> None:
        """The best weights with their card; without validation the last ones."""
        weights.write(folder, weights.BEST, tensors, card(run, data, training_data, at, folder, device))

    def draw() -> None:
        log.draw(folder, f"{run.method} on {data.label.strip()}")

    def saved(at: Checkpoint, better: bool) -> None:
        nonlocal drawn
        if better:
            write(at, at.exported)
        if time.perf_counter() - drawn > DRAWN:
            draw()
            drawn = time.perf_counter()

    show = _first_only(reporter.show)
    workers = options.jobs if device.type == "cuda" else 0
    loop = Loop(
        module,
        config,
        run.limit,
        run.seed,
        device,
        folder,
        validator,
        show,
        saved,
        workers,
        options.tensorboard,
    )
    if parallel.rank() == 0:
        request.write(folder, replace(run, job=parallel.job()))
        for note in training_data.notes:
            reporter.say(note)
        if start is None:
            reporter.say(_amount(training_data, config))
        if run.processes != parallel.world():
            reporter.say(f"this run began with {run.processes} processes; its batches are now others")
        reporter.began(run, start or Checkpoint(0, 0.0, {}))
    at = loop.run(start, time.perf_counter() - begun if run.limit.seconds else 0.0)
    if parallel.rank() == 0:
        write(at, at.exported if at.best else loop.export())
        draw()
    return TrainingResult(folder, at, run)


def _first_only(call: Callable[..., Any]) -> Callable[..., Any]:
    """The call in the first process, nothing in the others."""
    return call if parallel.rank() == 0 else lambda *_: None


def _validator(
    data: Any, module: Any, cases: int, limit: float, device: torch.device, reporter: ProgressReporter
) -> Validator | None:
    """For the first process; None where there is nothing to validate on. limit: seconds of a validation,
    0: none."""
    if parallel.rank() > 0:
        return None
    why = UNPARTED
    if (aside := data.validation()) is not None:
        aside = complete(aside, Dataset)
        if validator := Validator(aside, module.method(), cases, device, reporter.loading):
            every = len(validator)
            if limit:
                validator.fit(module.modules, module.method(), limit)
            if len(validator) < every:
                reporter.say(
                    f"validating {len(validator)} of {every} cases: the budget has no time for more"
                )
            return validator
        why = "the method supports no validation case that has a right answer"
    reporter.say(f"{why}: {UNWATCHED}")
    return None


# -------------------------------------------------------------------------------------- what is asked
def folder_of(options: TrainingOptions) -> Path:
    """The folder of a run. Raises BenchError where no option names one."""
    if options.out is not None:
        return options.out
    if options.method is None:
        raise BenchError("say which METHOD to train, or which run to go on with: --resume --out DIR")
    return FOLDER / registry.canonical("methods", options.method).slug


def _settled(options: TrainingOptions) -> tuple[Path, Request]:
    """The folder, and the run that it holds or will hold. Raises BenchError."""
    method = registry.canonical("methods", options.method) if options.method else None
    folder = folder_of(options)
    earlier = request.read(folder)
    again = earlier is not None and parallel.restarted() and earlier.job == parallel.job()
    if earlier is not None and not options.resume and not again:
        raise BenchError(
            f"{folder} already holds a run ({earlier.command}); go on with it by --resume, or give "
            "another --out"
        )
    if earlier is not None:
        return folder, _extended(folder, _same(earlier, options, method), options.budget)
    if method is None:
        raise BenchError(f"{folder} holds no run to go on with; bench train METHOD begins one")
    if options.resume and options.dataset is None:
        raise BenchError(f"{folder} holds no run to go on with; with -d DATASET one begins")
    return folder, _new(options, method)


def _same(run: Request, options: TrainingOptions, method: Spec | None) -> Request:
    """The run, with its data where they lie now. Raises BenchError where it cannot go on as it began."""
    explicit = {"method": method and str(method), "preset": options.preset, "seed": options.seed}
    explicit |= {"precision": options.precision, "augment": options.augment or None}
    request.contradicted(run, explicit)
    if options.dataset is not None:
        data = str(joint_datasets.canonical(options.dataset))
        if request.without_places(data) != request.without_places(run.dataset):
            request.contradicted(run, {"dataset": data})
        run = replace(run, dataset=data)
    spec = Spec.parse(run.method)
    built = _trainable(spec)
    version = str(built.card.version)
    if (version, dict(built.facts())) != (run.version, dict(run.facts)):
        raise BenchError(
            f"{run.method} is not what this run began with (version {run.version}, now {version}, or "
            "other parameters); train anew in another folder"
        )
    if options.init is not None:
        request.contradicted(run, {"init": _initial_weights(spec, options.init).hash})
    if joint_datasets.dataset(Spec.parse(run.dataset)).content != run.content:
        raise BenchError(_OTHER_DATA.format(run.dataset))
    return run


def _extended(folder: Path, run: Request, budget: str | None) -> Request:
    """The run under another budget, "" being its preset's. Raises BenchError where none of it is left."""
    if budget is None or budget == run.budget:
        return run
    if not budget:
        request.contradicted(run, {"budget": budget})
    limit, at = Budget.parse(budget), checkpoint.read(folder) or Checkpoint(0, 0.0, {})
    if limit.used(at.step, at.seconds) >= 1.0:
        raise BenchError(
            f"{folder} holds a run of {at.step} steps in {at.seconds:.0f} s, and a budget of {budget} "
            "leaves nothing to go on with; give a longer one"
        )
    earlier = (*run.earlier, f"{run.budget or f'{run.recipe.steps}it'} (up to step {at.step})")
    config = replace(run.recipe, steps=limit.steps) if limit.steps else run.recipe
    return replace(run, budget=budget, recipe=config, earlier=earlier if at.step else run.earlier)


def _with_motion(run: Request, training_data: TrainingData) -> Request:
    """The run with its motion's hash. Raises BenchError where it began with other motion."""
    if run.motion not in ("", training_data.hash):
        raise BenchError(_OTHER_DATA.format(run.dataset))
    return replace(run, motion=training_data.hash)


def _new(options: TrainingOptions, method: Spec) -> Request:
    if options.dataset is None:
        raise BenchError("say what to train on: -d DATASET")
    data_spec = joint_datasets.canonical(options.dataset)
    built, data = _trainable(method), joint_datasets.dataset(data_spec)
    name = options.preset or "default"
    if name not in (offered := presets(built)):
        raise BenchError(f"{method.name} has no preset {name!r}; there are {', '.join(offered)}")
    config = offered[name]
    if options.budget and (limit := Budget.parse(options.budget)).steps:
        config = replace(config, steps=limit.steps)
    config = replace(config, precision=options.precision or config.precision)
    if options.augment:
        config = replace(config, augmentation=_augmentation(method, built, config))
    before = _initial_weights(method, options.init).card if options.init else {}
    manifest = before.get("training_manifest") or {}
    return Request(
        method=str(method),
        dataset=str(data_spec),
        preset=name,
        budget=options.budget or "",
        seed=options.seed or 0,
        recipe=config,
        version=str(built.card.version),
        facts=dict(built.facts()),
        label=data.label,
        content=data.content,
        init=str(before.get("hash", "")),
        init_path=options.init or "",
        seen=manifest,
        seen_all=bool(manifest) and UNKNOWN not in before.get("notes", ()),
        processes=parallel.world(),
        versions=versions(),
    )


def _augmentation(method: Spec, built: Any, config: TrainingConfig) -> Augmentation:
    """Raises BenchError where there are no windows of single motions that could be changed."""
    if built.from_pairs:
        raise BenchError(f"{method.name} learns from pairs, and --augment makes no pair of a pair")
    if config.window == 1:
        raise BenchError(f"{method.name} learns from single frames, and --augment changes windows")
    return config.augmentation or Augmentation()


def _amount(training_data: TrainingData, config: TrainingConfig) -> str:
    """The amount of training motion, as a sentence: with a few minutes of motion people have forgotten a
    parameter of the data set, and clips that are shorter than a window are mostly padding."""
    clips = [clip for of_body in training_data.clips.values() for clip in of_body]
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


def _initial_weights(spec: Spec, name_or_path: str) -> weights.Bundle:
    """Weights to begin with: the name of shipped ones, or a path. Raises BenchError."""
    built = _trainable(spec)
    shipped: Mapping[str, Path] = getattr(built, "shipped", dict)()
    version, facts = str(built.card.version), dict(built.facts())
    return weights.read(
        shipped.get(name_or_path, name_or_path), method=spec.name, version=version, facts=facts
    )
