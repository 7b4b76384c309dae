"""``bench probe``: invariance of a method to equivalent inputs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from retarget_bench.commands import options
from retarget_bench.commands.terminal import echo
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.python.plans import dataset_spec

if TYPE_CHECKING:
    from retarget_bench.api import CaseInfo, Dataset
    from retarget_bench.results.store import ResultPaths
    from retarget_bench.verification.probe.asking import Reply, Subject


@click.command("probe")
@options.methods_argument("METHOD...", required=True)
@options.dataset_option
@options.root_option
@options.split_option
@click.option("--source", type=options.PATH, metavar="FILE", help="A motion file instead of a data set.")
@click.option("--target", type=options.PATH, metavar="FILE", help="Motion file of the target.")
@click.option("--cases", type=click.IntRange(1), default=24, show_default=True, help="Number of cases.")
@click.option("--only", metavar="ID,ID", default="", help="Only these probes.")
@click.option("--strict", is_flag=True, help="Exit 1 if a probe fails.")
@options.out_option
def command(
    methods: tuple[str, ...],
    dataset: str,
    root: str | None,
    splits: tuple[str, ...],
    source: Path | None,
    target: Path | None,
    cases: int,
    only: str,
    strict: bool,
    out: Path,
) -> int:
    """Give methods equivalent inputs, and measure by how much their answers differ.

    Names, order and axes of joints, rest poses, split and merged bones, size, unit, place, heading, mirror
    image, time and frame rate are changed one by one; the answer must stay the same, or change with them.
    It also measures whether answers depend on the source. Exits 0 with findings, or 1 with --strict.
    """
    from retarget_bench.verification.probe.probes import PROBES

    known = {probe.id: probe for probe in PROBES}
    if unknown := [name for name in options.ids(only) if name not in known]:
        raise BenchError(f"no probe is called {unknown[0]!r}; there are {', '.join(known)}")
    probes = [known[name] for name in options.ids(only)] or list(PROBES)
    specs = [registry.canonical("methods", named.parse(name)) for name in methods]
    data = None
    if source and target:
        subjects, groups = _of_files(source, target)
    elif source or target:
        raise BenchError("give both --source and --target, or neither of them")
    else:
        data = registry.canonical("datasets", dataset_spec(dataset, root))
        subjects, groups = _of_dataset(data, splits, cases)
    from tqdm import tqdm

    from retarget_bench.plugins import bound
    from retarget_bench.verification.probe.asking import ask

    with tqdm(total=len(specs) * len(subjects), desc="bench probe", unit="case", leave=False) as bar:
        answers = {
            spec: ask(bound.method(spec).built, str(spec), subjects, groups, probes, bar.update)
            for spec in specs
        }
    return int(_report(answers, data, out) and strict)


Questions = tuple[list["Subject"], list[list["Subject"]]]
"""Subjects of the probes, and groups for the dependence on the source."""


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


def _loaded(data: Dataset, infos: Sequence[CaseInfo]) -> list[Subject]:
    from retarget_bench.verification.probe.asking import Subject, subject

    loaded = ((info, data.load(info)) for info in infos)
    found = [subject(info, case.source, case.target) for info, case in loaded]
    if reasons := [each for each in found if isinstance(each, str)]:
        echo(f"{len(reasons)} of {len(found)} cases cannot be asked: {reasons[0]}", err=True)
    return [each for each in found if isinstance(each, Subject)]


def _of_files(source: Path, target: Path) -> Questions:
    from retarget_bench.api import CROSS, CaseInfo
    from retarget_bench.motion import importer
    from retarget_bench.verification.probe.asking import Subject, pieces, subject

    performer, body = importer.load(source), importer.load(target)
    for side in (performer, body):
        for warning in side.findings.warnings:
            echo(f"{side.findings.path}: {warning}", err=True)
    names = (performer.motion.character.name, body.motion.character.name)
    case = f"files/{names[0]}>{names[1]}/{source.stem}"
    info = CaseInfo(case, "probe", CROSS, *names, clip=source.stem)
    found = subject(info, performer.motion, body.motion.character)
    assert isinstance(found, Subject)
    parts = pieces(found)
    return [found], [parts] if parts else []


def _report(answers: dict[Spec, list[Reply]], data: Spec | None, out: Path) -> bool:
    """Print the table, what is off, and where the rows lie. True where something is off."""
    from retarget_bench.analysis import summary
    from retarget_bench.tables import builder
    from retarget_bench.tables.rendering import RENDERERS
    from retarget_bench.verification.probe import report

    if data is None:
        for spec, replies in answers.items():
            echo(report.listing(str(spec), replies))
    else:
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
    if data is not None:
        echo(f"The table again: bench table {out} --probes. Rows lie in {out}/.")
    return bool(off)
