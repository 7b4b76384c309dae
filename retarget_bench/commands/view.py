"""``bench view``: motion live in the browser, on this machine alone."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from retarget_bench import defaults
from retarget_bench.commands import echo
from retarget_bench.commands.options import FILES, OfResults, check_task, takes
from retarget_bench.errors import BenchError
from retarget_bench.options import OfMethods, WithData, listed, option

if TYPE_CHECKING:
    from retarget_bench.viewer.scene_builder import CaseList, Over

PORT = 8080


class Options(OfResults, OfMethods, WithData):
    """``bench view``."""

    task: str = option("Results of this task.", default=defaults.TASK)
    port: int = option(
        "Where the page is served; 0: any port that is free.", default=PORT, at_least=0, below=65536
    )
    no_open: bool = option("Do not open the browser, only say where to look.", default=False)


@click.command("view")
@click.argument("sources", nargs=-1, metavar="[SOURCE]...", shell_complete=FILES)
@takes(Options)
def command(sources: tuple[str, ...], options: Options) -> None:
    """Show motion live in the browser: played, scrubbed, turned, side by side or overlaid.

    SOURCE: folders of results (also of a run that is still going on: new cases appear), a case's id or a
    part of it, or motion files. [default: runs] Only this machine can see the page. Ctrl-C stops.

    \b
    bench view
    bench view 'rex>fox/dog_sit' -m ik
    bench view walk.bvh retargeted.bvh
    """
    from retarget_bench.python.progress import stepped
    from retarget_bench.viewer import live

    check_task(options.task)
    with stepped("bench view") as over:
        case_list, case = _case_list(sources, options, over)
    try:
        window = live.Window(case_list, options.port, case)
    except OSError as error:
        raise BenchError(
            f"port {options.port} cannot be used ({error.strerror}); choose another by --port, or 0 for "
            "any that is free"
        ) from error
    try:
        window.check()
        echo(f"{window.url} shows it; Ctrl-C stops")
        if not options.no_open:
            _open(window.url)
        window.serve_forever()
    except KeyboardInterrupt:
        echo("stopped")
    finally:
        window.server_close()


def _case_list(sources: Sequence[str], options: Options, over: Over) -> tuple[CaseList, str | None]:
    """The requested cases, and the first to show: of results, or of files as they are, a stored prediction
    with its case. Raises BenchError where there are none."""
    from retarget_bench.viewer import results_library
    from retarget_bench.viewer.scene_builder import CaseList

    paths = [Path(source) for source in sources]
    folders = [path for path in paths if path.is_dir()]
    if sources and not folders and results_library.are_files(sources):
        if len(paths) == 1 and (stored := results_library.place_of(paths[0])) is not None:
            place, case = stored
            return CaseList([place.root], place.task, place.dataset, root=options.root), case
        return CaseList(files=paths), None
    names = [source for source in sources if not Path(source).is_dir()]
    if len(names) > 1 or (names and folders):
        raise BenchError("give folders of results, or one case, or motion files")
    roots = folders or options.roots
    case_list = CaseList(roots, options.task, options.only, listed(options.methods), root=options.root)
    cases = case_list.refresh(over)
    if case_list.problem and not cases:
        raise BenchError(case_list.problem)
    if not cases and not any(folder.is_dir() for folder in roots):
        raise BenchError(f"there is no folder {', '.join(map(str, roots))}; bench run makes one")
    return case_list, results_library.matching(cases, names[0]) if names else None


def _open(url: str) -> None:
    """Open the page in a browser, where there is a display."""
    import os
    import sys
    import webbrowser

    if not sys.platform.startswith("linux") or any(
        os.environ.get(n) for n in ("DISPLAY", "WAYLAND_DISPLAY")
    ):
        webbrowser.open(url)
