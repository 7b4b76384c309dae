"""Provenance of rows: method version, code, date, versions, and the command that makes them again."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.api import TASKS
from retarget_bench.plugins.spec import Spec
from retarget_bench.results.header import MethodInfo, ResultHeader
from retarget_bench.tables.model import Provenance


def provenance(sections: Sequence[SplitSummary]) -> tuple[Provenance, ...]:
    """One entry per method; splits made by another version, code or seeds have their own."""
    grouped: dict[tuple[Any, ...], dict[str, ResultHeader]] = {}
    for section in sections:
        for score in section.scores:
            header, method = score.header, score.header.method
            versions, seeds = tuple(header.versions.items()), tuple(header.seeds)
            alike = (score.label, method.version, method.code, header.revision, versions, seeds)
            grouped.setdefault(alike, {})[section.split] = header
    return tuple(_entry(facts[0], headers) for facts, headers in grouped.items())


def _entry(label: str, headers: Mapping[str, ResultHeader]) -> Provenance:
    header = next(iter(headers.values()))
    method = header.method
    return Provenance(
        label=label,
        about=method.summary,
        splits=tuple(headers),
        version=method.version or "",
        code=method.code or "",
        seeds=tuple(header.seeds),
        date=max(each.date for each in headers.values())[:10],
        revision=header.revision,
        versions=", ".join(f"{name} {which}" for name, which in header.versions.items()) + _there(method),
        command=_command([_asked_as(method)], header, list(headers)),
    )


def _there(method: MethodInfo) -> str:
    """The environment that a method answered in, where it was another one."""
    if not (environment := method.environment):
        return ""
    packages = [f"{name} {version}" for name, version in environment["packages"].items()]
    versions = ", ".join((environment["python"], *packages))
    return f"; answered in {environment['name']} (lock {environment['lock']}): {versions}"


def commands(sections: Sequence[SplitSummary]) -> list[str]:
    """The commands that make all rows again: one for the methods of the same data, splits and seeds."""
    headers_of: dict[str, dict[str, ResultHeader]] = {}
    for section in sections:
        for score in section.scores:
            headers_of.setdefault(score.label, {})[section.split] = score.header
    alike: dict[str, tuple[list[str], ResultHeader, list[str]]] = {}
    for headers in headers_of.values():
        header, splits = next(iter(headers.values())), list(headers)
        again = alike.setdefault(_command([], header, splits), ([], header, splits))
        again[0].append(_asked_as(header.method))
    return [_command(*each) for each in alike.values()]


def _asked_as(method: MethodInfo) -> str:
    """The method as it is asked for again."""
    if not method.environment:
        return method.label
    return str(replace(Spec.parse(method.label), environment="PYTHON"))


def _command(labels: Sequence[str], header: ResultHeader, splits: Sequence[str]) -> str:
    """The command that makes rows again, without the paths of the data and of another Python.

    header: of one of them.
    """
    dataset = header.dataset
    if header.method.external:
        return "bench score FOLDER"
    data = Spec(dataset.name, dataset.parameters)
    words = ["bench", "run", *labels, "-d", str(data), "-s", ",".join(splits)]
    words += ["--task", header.task] if header.task not in ("", TASKS[0]) else []
    if seeds := header.seeds:
        words += ["--seed", str(seeds[0]), *(["--seeds", str(len(seeds))] if len(seeds) > 1 else [])]
    return shlex.join(words)


def data_facts(sections: Sequence[SplitSummary]) -> tuple[tuple[str, str], ...]:
    """(fact, value) pairs of a data set, from its newest result."""
    headers = [score.header for section in sections for score in section.scores]
    dataset = max(headers, key=lambda header: header.date).dataset
    facts = [("data set", dataset.label), ("spec", str(Spec(dataset.name, dataset.parameters)))]
    if dataset.version:
        facts.append(("version", dataset.version))
    return (*facts, ("content", dataset.content))
