"""A release of the puppets freezes generator, lists and metrics: none may move under its name."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from retarget_bench.api import SPLITS
from retarget_bench.datasets.puppets import contract, dataset
from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.datasets.puppets.generator.corpus.clips import EXCLUSIONS, SIZES
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
        clips = [
            f"{name} {clip}" for bodies in cast.values() for name in bodies for clip in bodies[name].names
        ]
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


def moved(recorded: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """What differs from a release, in words; metrics that it does not have may come."""
    changes = []
    if now["release"] != recorded["release"]:
        changes.append(f"the release is called {now['release']} now")
    if now["generator"] != recorded["generator"]:
        changes.append(f"the generator has version {now['generator']}, not {recorded['generator']}")
    for name, digest in recorded["lists"].items():
        if now["lists"].get(name) != digest:
            changes.append(f"the list of {name} is another one")
    for name, version in recorded["metrics"].items():
        if (current := now["metrics"].get(name)) != version:
            changes.append(f"metric {name} has version {current}, not {version}")
    return changes


def test_nothing_has_moved_under_the_name_of_the_release() -> None:
    recorded = json.loads(FILE.read_text(encoding="utf-8"))
    changes = moved(recorded, release())
    assert not changes, (
        f"{recorded['release']} froze generator, lists and metrics, but {'; '.join(changes)}. Undo that, "
        "or make a new release: RELEASE in datasets/puppets/dataset.py and VERSION in contract.py, then "
        "PYTHONPATH=. python tests/datasets/freeze_puppets.py"
    )
