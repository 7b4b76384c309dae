"""Training clips of a data set, processed in parallel by character."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from retarget_bench.api import Dataset
from retarget_bench.api.datasets import Cast
from retarget_bench.errors import NotSupported
from retarget_bench.parallel import carried_out
from retarget_bench.plugins.registry import files as plugin_files

Progress = Callable[[int, int], None]
"""Called with the number of characters done and their total."""


def training_clips(data: Dataset) -> Cast:
    """The training clips of a data set. Raises NotSupported where that is nothing."""
    clips = data.training()
    usable = {structure: characters for structure, characters in clips.items() if characters}
    if not usable:
        why = "; ".join(data.training_notes) or "see Dataset in retarget_bench/api"
        raise NotSupported(f"{data.label.strip()} has no training motion; {why}")
    return usable


def by_character(
    task: Callable[[Any], Any],
    names: Sequence[str],
    common: Mapping[str, Any],
    jobs: int,
    progress: Progress,
) -> dict[str, Any]:
    """Character -> what a task makes of it, in the order of the names.

    task: a function of a module; it gets ``common``, the name under ``character``, and ``plugins``.
    Raises NotSupported where it fails.
    """
    payloads = [{**common, "character": name, "plugins": plugin_files()} for name in names]
    by_name: dict[str, Any] = {}
    progress(0, len(names))
    for outcome in carried_out(task, payloads, jobs):
        if outcome.error:
            raise NotSupported(
                f"{names[outcome.number]}: its training motion cannot be had: {outcome.error}"
            )
        by_name[names[outcome.number]] = outcome.result
        progress(len(by_name), len(names))
    return {name: by_name[name] for name in names}
