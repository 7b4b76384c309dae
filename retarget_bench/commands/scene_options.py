"""Options of commands that show motion, and the scene that they describe."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from retarget_bench import defaults
from retarget_bench.commands.options import dataset_spec, plugin_names, plugin_option, results_option
from retarget_bench.errors import BenchError
from retarget_bench.plugins import registry

if TYPE_CHECKING:
    from retarget_bench.viewer.scene import Scene

F = TypeVar("F", bound=Callable[..., Any])

methods_option = click.option(
    "-m",
    "--method",
    "methods",
    multiple=True,
    metavar="METHOD",
    shell_complete=plugin_names("methods"),
    help="Only these methods, in this order; may be repeated. [default: all that there are]",
)
task_option = click.option("--task", default="retarget", show_default=True, help="Results of this task.")


def source_options(command: F) -> F:
    """Which results and methods are shown: ``results``, ``methods``, ``dataset``, ``root``, ``task``,
    ``ask``, ``hidden``."""
    for option in (
        plugin_option,
        click.option(
            "--hide",
            "hidden",
            multiple=True,
            type=click.Choice(["source", "reference"]),
            help="Leave the source or the reference out.",
        ),
        task_option,
        click.option(
            "--ask",
            is_flag=True,
            help="Ask the methods now, for a case of DATASET, and store nothing.",
        ),
        click.option(
            "--root",
            metavar="DIR",
            type=click.Path(),
            help="Where the data lie, if not as usual.",
        ),
        click.option(
            "-d",
            "--dataset",
            metavar="DATASET",
            help="Only results of this data set (a folder name under RESULTS); with --ask, the data set.",
        ),
        methods_option,
        results_option,
    ):
        command = option(command)
    return command


def scene_of(
    names: Sequence[str],
    *,
    results: Sequence[Path] = (),
    methods: Sequence[str] = (),
    dataset: str | None = None,
    root: str | None = None,
    task: str = "retarget",
    ask: bool = False,
    hidden: Sequence[str] = (),
) -> Scene:
    """The scene of a case, or of files, that a command's words describe. Raises BenchError."""
    from dataclasses import replace

    from retarget_bench.viewer import results_library, scene_builder

    if results_library.are_files(names):
        found = _of_files(names, root)
    elif len(names) != 1:
        raise BenchError("one case is shown at a time; give one, or motion files")
    elif ask:
        found = _asked(names[0], methods, dataset, root)
    else:
        roots = results or (Path("runs"),)
        places = results_library.results(roots, task, dataset, methods)
        having, case_id = results_library.case(places, names[0])
        found = scene_builder.of_case(having, case_id, dataset=_moved(having, root))
        found = replace(found, colours=results_library.colours(roots))
    shown = [figure for figure in found.figures if figure.part not in hidden]
    return replace(found, figures=tuple(shown))


def _of_files(names: Sequence[str], root: str | None) -> Scene:
    """A stored prediction is shown with its case; other files as they are."""
    from dataclasses import replace

    from retarget_bench.viewer import results_library, scene_builder

    paths = [Path(name) for name in names]
    stored = [results_library.place_of(path) for path in paths]
    places = [each[0] for each in stored if each is not None]
    if len(places) == len(paths) and len({each[1] for each in stored if each is not None}) == 1:
        assert stored[0] is not None
        found = scene_builder.of_case(places, stored[0][1], dataset=_moved(places, root))
        return replace(found, colours=results_library.colours({place.root for place in places}))
    return scene_builder.of_files(paths)


def _asked(name: str, methods: Sequence[str], dataset: str | None, root: str | None) -> Scene:
    """A case of a data set with what methods answer now."""
    from retarget_bench.api import TASKS
    from retarget_bench.evaluation import plan
    from retarget_bench.plugins.spec import Spec
    from retarget_bench.viewer import results_library, scene_builder

    if not methods:
        raise BenchError("say which methods to ask: --ask -m METHOD")
    spec = dataset_spec(dataset or defaults.DATASET, root)
    data = plan.dataset(registry.canonical("datasets", spec))
    ids = [info.id for split in data.card.splits for info in data.cases(TASKS[0], split)]
    return scene_builder.of_case_asked(
        spec, None, results_library.matching(ids, name), [Spec.parse(m) for m in methods]
    )


def _moved(places: Sequence[Any], root: str | None) -> Any:
    """The data set of results, at the place where its data lie now; None where that was not said."""
    from retarget_bench.viewer import results_library

    return (
        None if root is None else results_library.read_stored(places[0]).dataset.with_parameters(root=root)
    )
