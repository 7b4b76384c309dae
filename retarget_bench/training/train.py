"""``bench train`` from options to weights: settle the request, gather motion, run the loop."""

import shlex
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import field, replace
from pathlib import Path
from typing import Any, Protocol

import torch

from retarget_bench.api import Dataset
from retarget_bench.api.completing import complete
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.header_builder import versions
from retarget_bench.plugins import bound, named, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import joint_datasets, log, parallel, run_folder, weights
from retarget_bench.training.card import OTHER_DATA, UNKNOWN, UNWATCHED, card, completed
from retarget_bench.training.config import Augmentation, Budget, TrainingConfig, presets
from retarget_bench.training.data import TrainingData
from retarget_bench.training.gather import gather
from retarget_bench.training.learned_method import LearnedMethod
from retarget_bench.training.loop import LEAST, Loop, TrainingStatus
from retarget_bench.training.pair_data import gather_pairs
from retarget_bench.training.phases import set_deterministic
from retarget_bench.training.record import Run, TrainedOn
from retarget_bench.training.settings import TrainingSettings
from retarget_bench.training.validate import Validator

FOLDER = Path("runs/train")
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
    def began(self, run: Run) -> None: ...
    def show(self, status: TrainingStatus) -> None: ...


def train(options: TrainingOptions, reporter: ProgressReporter, begun: float | None = None) -> Run:
    """Train a method, or go on with it; the run as it ended.

    begun: when the command began, by ``perf_counter``, which a budget of time counts from; None: now.
    Raises BenchError for whatever stands in the way."""
    begun = time.perf_counter() if begun is None else begun
    device = parallel.device(options.device)
    set_deterministic(device)
    parallel.join(device)
    try:
        with ExitStack() as held:  # in the first process the lock of the folder

            def settled() -> tuple[Path, Run]:
                held.enter_context(run_folder.locked(folder_of(options)))
                return _settled(options)

            folder, run = parallel.first(settled)
            return _train(folder, run, options, reporter, device, begun)
    except torch.cuda.OutOfMemoryError as error:
        raise BenchError(
            f"{device} has not enough memory for this batch; ask for a smaller one with --batch, or spread "
            "it over more processes"
        ) from error
    finally:
        parallel.leave()


def finished(options: TrainingOptions) -> bool:
    """True if the run that is to go on has used up its budget and its weights are there.

    Raises BenchError where its folder holds another run than the options name.
    """
    if options.out is None or run_folder.read(options.out) is None:
        return False
    folder, run = _settled(options)
    return run.ended and (folder / f"{weights.BEST}.json").exists()


def _train(
    folder: Path,
    run: Run,
    options: TrainingOptions,
    reporter: ProgressReporter,
    device: torch.device,
    begun: float,
) -> Run:
    _know_files(run)  # also in processes that have not read it
    spec, data_spec = Spec.parse(run.scored_as), Spec.parse(run.dataset)
    data, config = joint_datasets.dataset(data_spec), run.recipe
    gathering = _first_only(reporter.gathering)
    training_data = parallel.in_turn(
        lambda: (
            gather_pairs(data_spec, spec, config.fps, options.jobs, gathering)
            if bound.method(spec).built.from_pairs
            else gather(data_spec, spec, config.fps, options.jobs, gathering, config.augmentation)
        )
    )
    before, run = run, parallel.first(lambda: completed(run, data, training_data, device))
    torch.manual_seed(run.seed)
    module = bound.method(spec).built.training_module(training_data, config)  # type: ignore[attr-defined]
    tensors = run_folder.tensors(folder, run)
    if run.init and not tensors:
        initial = _initial_weights(spec, run.init_path)
        if initial.hash != run.init:
            raise BenchError(f"{run.init_path}: these are no longer the weights that this run began with")
        module.load(initial.tensors)
    module.modules.to(device)
    left = max(0.0, run.limit.seconds - run.seconds)
    validator = _validator(data, module, config.cases, left * LEAST, device, reporter)
    drawn = time.perf_counter()

    def write(chosen: Mapping[str, torch.Tensor]) -> None:
        """Weights with their card."""
        weights.write(folder, weights.BEST, chosen, card(loop.at, folder))

    def draw() -> None:
        log.draw(folder, f"{run.scored_as} on {data.label.strip()}")

    def saved(better: bool) -> None:
        nonlocal drawn
        if better:
            write(loop.best)
        if time.perf_counter() - drawn > DRAWN:
            draw()
            drawn = time.perf_counter()

    show = _first_only(reporter.show)
    workers = options.jobs if device.type == "cuda" else 0
    loop = Loop(run, module, device, folder, validator, show, saved, workers)
    if parallel.rank() == 0:
        run_folder.write(folder, run)
        for note in training_data.notes:
            reporter.say(note)
        if not run.steps:
            reporter.say(_amount(training_data, config))
        if before.processes != run.processes:
            reporter.say(f"this run had {before.processes} processes before; its batches are now others")
        reporter.began(run)
    run = loop.run(tensors, time.perf_counter() - begun if run.limit.seconds else 0.0)
    if parallel.rank() == 0:
        write(loop.best or loop.export())
        draw()
    return run


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
    why = "the data set has no validation part"
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


def _settled(options: TrainingOptions) -> tuple[Path, Run]:
    """The folder, and the run that it holds or will hold. Raises BenchError."""
    method = _without_weights(registry.canonical("methods", options.method)) if options.method else None
    folder = folder_of(options)
    earlier = run_folder.read(folder)
    again = earlier is not None and parallel.restarted() and earlier.job == parallel.job()
    if earlier is not None and not options.resume and not again:
        raise BenchError(
            f"{folder} already holds a run ({earlier.command}); go on with it by --resume, or give "
            "another --out"
        )
    if earlier is not None:
        _know_files(earlier)
        return folder, _extended(folder, _same(earlier, options, method), options.budget)
    if method is None:
        raise BenchError(f"{folder} holds no run to go on with; bench train METHOD begins one")
    if options.resume and options.dataset is None:
        raise BenchError(f"{folder} holds no run to go on with; with -d DATASET one begins")
    return folder, _new(options, method)


def _know_files(run: Run) -> None:
    """Make the plug-ins of a run known that were named by their files, unless the command names them."""
    known = {Path(file).stem for file, _ in registry.files()}
    registry.know_files(each for each in run.plugin_files if Path(each[0]).stem not in known)


def _without_weights(method: Spec) -> Spec:
    """Those that are trained take their place."""
    return replace(method, parameters={k: x for k, x in method.parameters.items() if k != "weights"})


def _same(run: Run, options: TrainingOptions, method: Spec | None) -> Run:
    """The run, with its data where they lie now. Raises BenchError where it cannot go on as it began."""
    contradicted("method", run.scored_as, method and str(method))
    contradicted("preset", run.preset, options.preset)
    contradicted("seed", run.seed, options.seed)
    contradicted("batch", run.recipe.batch, options.batch)
    contradicted("precision", run.recipe.precision, options.precision)
    contradicted("augment", run.recipe.augmentation is not None, options.augment or None)
    if options.dataset is not None:
        data = joint_datasets.canonical(options.dataset)
        if str(joint_datasets.without_places(data)) != run.data.spec:
            contradicted("dataset", run.dataset, str(data))
        run = replace(run, dataset=str(data))
    spec = Spec.parse(run.scored_as)
    built = _trainable(spec)
    version = str(built.card.version)
    before, now = {"version": run.version, **run.facts}, {"version": version, **built.facts()}
    if other := [name for name in before | now if before.get(name) != now.get(name)]:
        raise BenchError(
            f"{spec} is not what this run began with (its {', '.join(other)}); train anew in another folder"
        )
    if options.init is not None:
        contradicted("init", run.init, _initial_weights(spec, options.init).hash)
    if joint_datasets.dataset(Spec.parse(run.dataset)).content != run.data.content:
        raise BenchError(OTHER_DATA.format(run.dataset))
    return run


def contradicted(option: str, before: object, value: object) -> None:
    """Raises BenchError where an option that was given (is not None) differs from the run's."""
    if value is not None and value != before:
        begun = f"no {option}" if before in ("", None) else f"{option} {before}"
        raise BenchError(
            f"this run began with {begun}, not {value}; leave the option out to go on with it, or give "
            "another --out to begin another run"
        )


def _extended(folder: Path, run: Run, budget: str | None) -> Run:
    """The run under another budget, "" being its preset's. Raises BenchError where none of it is left."""
    if budget is None or budget == run.budget:
        return run
    if not budget:
        contradicted("budget", run.budget, budget)
    limit = Budget.parse(budget)
    longer = replace(run, budget=budget, recipe=replace(run.recipe, steps=limit.steps or run.recipe.steps))
    if longer.ended:
        raise BenchError(
            f"{folder} holds a run of {run.steps} steps in {run.seconds:.0f} s, and a budget of {budget} "
            "leaves nothing to go on with; give a longer one"
        )
    before = f"the budget was {run.budget or f'{run.recipe.steps}it'} up to step {run.steps}"
    notes = [*run.notes, before] if run.steps else run.notes
    return replace(longer, notes=notes, command=_command(longer))


def _new(options: TrainingOptions, method: Spec) -> Run:
    if options.dataset is None:
        raise BenchError("say what to train on: -d DATASET")
    data_spec = joint_datasets.canonical(options.dataset)
    built, data = _trainable(method), joint_datasets.dataset(data_spec)
    name = options.preset or "default"
    if name not in (offered := presets(built)):
        raise BenchError(f"{method.name} has no preset {name!r}; there are {', '.join(offered)}")
    config = offered[name]
    if options.budget:
        config = replace(config, steps=Budget.parse(options.budget).steps or config.steps)
    config = replace(
        config, batch=options.batch or config.batch, precision=options.precision or config.precision
    )
    if options.augment:
        config = replace(config, augmentation=_augmentation(method, built, config))
    initial = _initial_weights(method, options.init).card if options.init else None
    seen = initial.training_manifest if initial else None
    unknown = initial is not None and (not seen or UNKNOWN in initial.notes)
    run = Run(
        method=method.name,
        version=str(built.card.version),
        facts=dict(built.facts()),
        data=TrainedOn(
            spec=str(joint_datasets.without_places(data_spec)), label=data.label, content=data.content
        ),
        recipe=config,
        preset=name,
        budget=options.budget or "",
        seed=options.seed or 0,
        init=initial.hash if initial else None,
        earlier=initial.frames if initial else 0,
        uncounted=initial is not None and (initial.uncounted or not initial.frames),
        scored_as=str(method),
        processes=parallel.world(),
        training_manifest=seen,
        notes=[UNKNOWN] if unknown else [],
        dataset=str(data_spec),
        init_path=options.init or "",
        plugin_files=registry.files(),
        versions=versions(),
    )
    return replace(run, command=_command(run))


def _command(run: Run) -> str:
    """The command that asks for a run, without places of files."""
    recipe, data = run.recipe, joint_datasets.split_spec(Spec.parse(run.data.spec))
    parts = ["bench", "train", named.written(Spec.parse(run.scored_as), places=False)]
    parts += [word for each in data for word in ("-d", named.written(each, places=False))]
    parts += ["--preset", run.preset]
    parts += ["--budget", run.budget] if run.budget else []
    own = presets(bound.method(Spec.parse(run.scored_as)).built)[run.preset]
    parts += ["--batch", str(recipe.batch)] if recipe.batch != own.batch else []
    parts += ["--precision", recipe.precision] if recipe.precision != TrainingConfig.precision else []
    parts += ["--augment"] if recipe.augmentation is not None else []
    parts += ["--init", "WEIGHTS"] if run.init else []
    return shlex.join([*parts, "--seed", str(run.seed)])


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
    if built.card.name != spec.name:
        raise BenchError(
            f"the plug-in is called {spec.name}, and its card {built.card.name}: its weights would be of "
            "neither; give both one name"
        )
    return built


def _initial_weights(spec: Spec, name_or_path: str) -> weights.Bundle:
    """Weights to begin with: the name of shipped ones, or a path. Raises BenchError."""
    built = _trainable(spec)
    shipped: Mapping[str, Path] = getattr(built, "shipped", dict)()
    bundle = weights.read(shipped.get(name_or_path, name_or_path))
    if isinstance(built, LearnedMethod):
        built.check_weights(name_or_path, bundle.card)
    else:
        weights.check(name_or_path, bundle.card, spec.name, str(built.card.version), built.facts())
    return bundle
