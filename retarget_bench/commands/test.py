"""``bench test``: the contract of a plug-in, and the invariance of a method to equivalent inputs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from retarget_bench import defaults
from retarget_bench.commands import echo
from retarget_bench.commands.options import plugin_names, takes
from retarget_bench.errors import BenchError
from retarget_bench.options import Names, OfSplits, listed, option
from retarget_bench.plugins import named, registry
from retarget_bench.plugins.spec import Spec

if TYPE_CHECKING:
    from retarget_bench.api import Case, CaseInfo, Dataset
    from retarget_bench.results.store import ResultPaths
    from retarget_bench.verification.probe.asking import Reply

ANY_PLUGIN = plugin_names(*registry.KINDS)
EVERYTHING = "all"


class TestOptions(OfSplits):
    """``bench test``."""

    dataset: str = option(
        "Try a method or metric on this data set.",
        default=defaults.DATASET,
        letter="d",
        metavar="DATASET",
        names=("datasets",),
    )
    probes: Names = option(
        "Give a method equivalent inputs instead, and measure by how much its "
        "answers differ: all, or these "
        "probes.",
        default=(),
        metavar="all|ID,ID",
    )
    limit: int = option("Of probes: so many cases.", default=24, at_least=1, metavar="N")
    out: Path = option(
        "Of probes: the folder of results.", default=Path(defaults.OUT), letter="o", metavar="DIR"
    )


@click.command("test")
@click.argument("plugins", metavar="NAME...", nargs=-1, required=True, shell_complete=ANY_PLUGIN)
@takes(TestOptions)
def command(plugins: tuple[str, ...], options: TestOptions) -> int:
    """Check that a plug-in keeps its contract: a line per check, exit status 1 if one fails.

    NAME is a method, metric, data set or post-processor, with parameters in brackets if needed, or a file.
    METHOD+POST is checked as a method.

    With --probes methods are given equivalent inputs: names, order and axes of joints, rest poses, split
    and merged bones, size, unit, place, heading, mirror image, time and frame rate are changed one by one;
    the answer must stay the same, or change with them. Whether answers depend on the source is measured,
    too.
    """
    if options.probes:
        return _probed(list(map(named.parse, plugins)), options)
    data = named.parse(options.dataset)
    failed = 0
    for name in plugins:
        spec = named.parse(name)
        kinds: list[registry.Kind] = ["methods"] if spec.posts else registry.kinds_of(spec.name)
        for kind in kinds:
            failed += _tested(kind, spec, data)
    return int(failed > 0)


def _tested(kind: registry.Kind, spec: Spec, data: Spec) -> int:
    """Print every check of one plug-in; the number of those that failed."""
    from retarget_bench.verification import contract

    echo(f"{registry.find(kind, spec.name)}")
    checks = []
    for check in contract.check(kind, spec, data):
        echo(f"  {check}")
        checks.append(check)
    failed = sum(not check.passed for check in checks)
    echo(f"{failed} of {len(checks)} checks failed" if failed else f"all {len(checks)} checks passed")
    return failed


# --------------------------------------------------------------------------------------------- probes
def _probed(methods: Sequence[Spec], asked: TestOptions) -> int:
    """Give methods equivalent inputs, and measure by how much their answers differ; 1 where one is off.

    Raises BenchError for unknown probes.
    """
    from retarget_bench.verification.probe.probes import PROBES

    known, names = {probe.id: probe for probe in PROBES}, listed(asked.probes)
    if unknown := [name for name in names if name not in (*known, EVERYTHING)]:
        raise BenchError(f"no probe is called {unknown[0]!r}; there are {', '.join(known)}")
    probes = list(PROBES) if EVERYTHING in names else [known[name] for name in names]
    specs = [registry.canonical("methods", spec) for spec in methods]
    data = registry.canonical("datasets", named.parse(asked.dataset))
    cases, groups = _of_dataset(data, listed(asked.splits), asked.limit)
    from tqdm import tqdm

    from retarget_bench.plugins import bound
    from retarget_bench.verification.probe.asking import ask

    with tqdm(total=len(specs) * len(cases), desc="bench test", unit="case", leave=False) as bar:
        answers = {
            spec: ask(bound.method(spec).built, str(spec), cases, groups, probes, bar.update)
            for spec in specs
        }
    return int(_report(answers, data, asked.out))


Questions = tuple[list["Case"], list[list["Case"]]]
"""Plain cases of the probes, and groups for the dependence on the source."""


def _of_dataset(spec: Spec, splits: Sequence[str], cases: int) -> Questions:
    from retarget_bench.api.datasets import chosen_splits
    from retarget_bench.plugins import bound
    from retarget_bench.verification.probe.asking import groups_of, spread

    data = bound.dataset(spec).built
    chosen = chosen_splits(data, splits)
    infos = {split: listed for split in chosen if (listed := data.cases("retarget", split))}
    if not infos:
        raise BenchError(f"{data.label} has no case in {', '.join(chosen)}: {' '.join(data.notes)}")
    structure = {name: body.structure for name, body in data.characters().items()}
    groups = [group for listed in infos.values() for group in groups_of(listed, structure)]
    loaded = [_loaded(data, group) for group in groups]
    return _loaded(data, spread(infos, cases)), [group for group in loaded if group]


def _loaded(data: Dataset, infos: Sequence[CaseInfo]) -> list[Case]:
    from retarget_bench.verification.probe.asking import plain

    cases = [plain(data.load(info)) for info in infos]
    if reasons := [each for each in cases if isinstance(each, str)]:
        echo(f"{len(reasons)} of {len(cases)} cases cannot be asked: {reasons[0]}", err=True)
    return [each for each in cases if not isinstance(each, str)]


def _report(answers: dict[Spec, list[Reply]], data: Spec, out: Path) -> bool:
    """Print the table, what is off, and where the rows lie. True where something is off."""
    from retarget_bench.analysis import summary
    from retarget_bench.tables import builder
    from retarget_bench.tables.rendering import RENDERERS
    from retarget_bench.verification.probe import report

    places: list[ResultPaths] = []
    for spec, replies in answers.items():
        places += report.store(spec, data, replies, out)
    found = summary.split_summaries(places)
    echo(RENDERERS["text"](builder.tables(found, builder.all_columns(found)[:-1])))
    off = []
    for spec, replies in answers.items():
        off += report.findings(str(spec), replies)
        for sentence in report.refusals(str(spec), replies):
            echo(sentence)
    echo("\n".join(off) if off else "All probes passed.")
    echo(f"The table again: bench table -r {out} --task probe. Rows lie in {out}/.")
    return bool(off)
