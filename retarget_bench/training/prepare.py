"""Training motion and pairs of a data set, made beforehand: ``bench train --prepare``."""

from collections.abc import Iterator, Mapping
from typing import Any

from retarget_bench.errors import NotSupported, Unusable
from retarget_bench.parallel import carried_out
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec

_PAIRS = 25
"""So many groups of pairs are one job."""


def prepare(data: Spec, jobs: int, unusable: list[str]) -> Iterator[tuple[int, int]]:
    """Ask for all training clips and pairs once, so that a data set keeps them in its cache.

    Yields what is done and the total: bodies, and groups of pairs. unusable: gets the clips that cannot be
    used, each with the reason. What is there already is read, so a
    command that was interrupted goes on. Raises NotSupported where something cannot be made.
    """
    built = bound.dataset(data).built
    names = [name for characters in built.training().values() for name in characters]
    pairs = built.training_pairs()
    groups = range(0, len(pairs), pairs.together) if pairs is not None else range(0)
    common = {"dataset": data, "plugins": registry.files()}
    payloads: list[dict[str, Any]] = [{**common, "character": name} for name in names]
    payloads += [
        {**common, "pairs": groups[first : first + _PAIRS]} for first in range(0, len(groups), _PAIRS)
    ]
    weights = [len(payload.get("pairs", "1")) for payload in payloads]
    done = 0
    for each in carried_out(make, payloads, jobs):
        if each.error:
            raise NotSupported(f"{data}: its training motion cannot be made: {each.error}")
        done += weights[each.number]
        unusable += each.result
        yield done, sum(weights)


def make(job: Mapping[str, Any]) -> list[str]:
    """Make one body's clips, or some groups of pairs; what a worker process does. Gives clips that cannot
    be used, with the reason."""
    registry.know_files(job["plugins"])
    data = bound.dataset(job["dataset"]).built
    if "pairs" in job:
        pairs = data.training_pairs()
        for index in job["pairs"]:
            assert pairs is not None
            pairs[index]
        return []
    (clips,) = (
        characters[job["character"]]
        for characters in data.training().values()
        if job["character"] in characters
    )
    unusable = []
    for number in range(len(clips)):
        try:
            clips[number]
        except Unusable as error:
            unusable.append(f"{error.clip} ({error.why})")
    return unusable
