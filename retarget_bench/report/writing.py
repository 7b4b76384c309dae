"""Writing the report: chapters, the motion in it, and the page."""

from collections.abc import Collection, Sequence
from pathlib import Path

from retarget_bench import files
from retarget_bench.errors import BenchError
from retarget_bench.figures import method_order
from retarget_bench.report import chapters, motions, page
from retarget_bench.report.motions import PackedScenes
from retarget_bench.results.store import ResultPaths


def write(
    output: Path,
    roots: Sequence[Path],
    *,
    task: str | None = None,
    dataset: str | None = None,
    methods: Sequence[str] = (),
    only: Collection[ResultPaths] = (),
    data: str | None = None,
    columns: Sequence[str] = (),
    title: str | None = None,
    clips: int | None = None,
    cases: Sequence[str] = (),
    motion: bool = True,
    skins: bool = False,
    variants: bool = False,
) -> PackedScenes:
    """Write the page of the results in some folders, and return the motion in it.

    only: of these results. data: the folder where the data lie. clips: how many cases
    can be seen in motion; None: all, or as many as fit ``motions.ROOM``. cases: ids of cases to show in
    motion, too. motion: False: none at all. variants: the first table has variants of methods.
    Raises BenchError where there are no results, and for a name that does not end in .html.
    """
    if output.suffix.lower() not in (".html", ".htm"):
        raise BenchError(f"{output}: a report is a page; end its name in .html")
    found = chapters.chapters(roots, task, dataset, methods, data, columns, only, variants)
    chosen = motions.chosen(found, clips, cases) if motion else []
    room = motions.ROOM if clips is None else motions.MOST_ROOM
    shown = motions.motions(found, chosen, room, skins)
    ranked = method_order.ranked(chapters.results(roots))
    files.write_text(output, page.page(found, shown, ranked, title))
    return shown
