"""A release of the puppets freezes generator, lists and metrics: none may move under its name."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import pytest

from retarget_bench.api import SPLITS
from retarget_bench.datasets.puppets import contract, dataset
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.corpus.clips import EXCLUSIONS, SIZES
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec

FILE = EXCLUSIONS.with_name("release.json")
"""Written by ``freeze_puppets.py``."""


def release() -> dict[str, Any]:
    """What is frozen: the generator's version, a hash of every list, the version of every metric."""
    lists: dict[str, str] = {}
    for size in SIZES:
        for part, data in Puppets(size=size).parts().items():
            for split in SPLITS:
                infos = data.cases("retarget", split)
                lists[f"{size} {part} {split}"] = digest([f"{info.id} {info.frames}" for info in infos])
        cast = Puppets(size=size).training()
        clips = [f"{name} {clip}" for mine in cast.values() for name in mine for clip in mine[name].names]
        lists[f"{size} training"] = digest(clips)
    built_in = [each.name for each in registry.names("metrics") if each.origin == registry.BUILT_IN]
    return {
        "release": dataset.RELEASE,
        "generator": contract.VERSION,
        "lists": lists,
        "metrics": {name: registry.create("metrics", Spec(name)).card.version for name in sorted(built_in)},
    }


def digest(lines: list[str]) -> str:
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:16]


def moved(known: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """What differs from a release, in words; metrics that it does not have may come."""
    found = []
    if now["release"] != known["release"]:
        found.append(f"the release is called {now['release']} now")
    if now["generator"] != known["generator"]:
        found.append(f"the generator has version {now['generator']}, not {known['generator']}")
    for name, digest in known["lists"].items():
        if now["lists"].get(name) != digest:
            found.append(f"the list of {name} is another one")
    for name, version in known["metrics"].items():
        if (mine := now["metrics"].get(name)) != version:
            found.append(f"metric {name} has version {mine}, not {version}")
    return found


def test_nothing_has_moved_under_the_name_of_the_release() -> None:
    known = json.loads(FILE.read_text(encoding="utf-8"))
    found = moved(known, release())
    assert not found, (
        f"{known['release']} froze generator, lists and metrics, but {'; '.join(found)}. Undo that, or "
        "make a new release: RELEASE in datasets/puppets/dataset.py and VERSION in contract.py, then "
        "PYTHONPATH=. python tests/datasets/freeze_puppets.py"
    )


@pytest.mark.parametrize(
    ("part", "name", "words"),
    [
        ("lists", "tiny test cross", "the list of tiny test cross is another one"),
        ("metrics", "contact", "metric contact has version new, not 1"),
        ("generator", None, "the generator has version new, not 3"),
        ("release", None, "the release is called new now"),
    ],
)
def test_whatever_moves_is_named(part: str, name: str | None, words: str) -> None:
    known = {
        "release": "1.0",
        "generator": "3",
        "lists": {"tiny test cross": "a"},
        "metrics": {"contact": "1"},
    }
    now = {**known, part: "new" if name is None else {name: "new"}}
    assert moved(known, known) == []
    (found,) = moved(known, now)
    assert found.startswith(words)
    assert moved(known, {**known, "metrics": {"contact": "1", "later": "1"}}) == []
