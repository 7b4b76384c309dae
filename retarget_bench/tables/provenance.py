"""Provenance of rows: method version, code, date, versions, and the command that makes them again."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from retarget_bench.analysis.summary import SplitSummary
from retarget_bench.plugins.spec import Spec
from retarget_bench.tables.model import Provenance

Header = Mapping[str, Any]


def provenance(found: Sequence[SplitSummary]) -> tuple[Provenance, ...]:
    """One entry per method; splits made by another version, code or seeds have their own."""
    grouped: dict[tuple[Any, ...], dict[str, Header]] = {}
    for section in found:
        for score in section.scores:
            alike = _facts(score.label, score.header)
            grouped.setdefault(alike, {})[section.split] = score.header
    return tuple(_entry(facts[0], headers) for facts, headers in grouped.items())


def _facts(label: str, header: Header) -> tuple[Any, ...]:
    """The facts in which two results of a method agree to share an entry."""
    method = header["method"]
    versions = tuple(header.get("versions", {}).items())
    seeds = tuple(header.get("seeds", ()))
    return label, method.get("version"), method.get("code"), header.get("revision"), versions, seeds


def _entry(label: str, headers: Mapping[str, Header]) -> Provenance:
    header = next(iter(headers.values()))
    method = header["method"]
    return Provenance(
        label=label,
        about=str(method.get("summary", "")),
        splits=tuple(headers),
        version=method.get("version", ""),
        code=method.get("code", ""),
        seeds=tuple(header.get("seeds", ())),
        date=max(each.get("date", "") for each in headers.values())[:10],
        revision=header.get("revision", ""),
        versions=", ".join(f"{name} {which}" for name, which in header.get("versions", {}).items()),
        command=_command(header, list(headers)),
    )


def _command(header: Header, splits: Sequence[str]) -> str:
    """The command that makes the rows again, without the path of the data."""
    method, dataset = header["method"], header["dataset"]
    if method.get("origin") == "predictions made elsewhere":
        return "bench score FOLDER"
    if "name" not in dataset:
        return ""
    data = Spec(dataset["name"], dataset.get("parameters", {}))
    words = ["bench", "run", method["label"], "-d", str(data), "-s", ",".join(splits)]
    if seeds := header.get("seeds"):
        words += ["--seed", str(seeds[0]), *(["--seeds", str(len(seeds))] if len(seeds) > 1 else [])]
    return shlex.join(words)


def data_facts(found: Sequence[SplitSummary]) -> tuple[tuple[str, str], ...]:
    """(fact, value) pairs of a data set, from its newest result."""
    headers = [score.header for section in found for score in section.scores]
    dataset = max(headers, key=lambda header: header.get("date", ""))["dataset"]
    facts = [("data set", dataset["label"])]
    if "name" in dataset:
        facts.append(("spec", str(Spec(dataset["name"], dataset.get("parameters", {})))))
    if dataset.get("version"):
        facts.append(("version", str(dataset["version"])))
    return (*facts, ("content", str(dataset["content"])))
