"""Writing the report: chapters, the motion in it, and the page."""

from collections.abc import Collection, Sequence
from os import PathLike
from pathlib import Path

from retarget_bench import files
from retarget_bench.errors import BenchError
from retarget_bench.figures import method_order
from retarget_bench.options import Names, OfMethods, WithData, listed, option
from retarget_bench.report import chapters, motions, page, sheet
from retarget_bench.report.appendix import appendix
from retarget_bench.report.motions import PackedScenes
from retarget_bench.results.store import ResultPaths
from retarget_bench.viewer.scene_builder import Over


class ReportOptions(OfMethods, WithData):
    """What a report shows."""

    out: str | PathLike[str] = option(
        "The page: .html, or .pdf for a paper's appendix, without motion, a page for each task, data set "
        "and group of bodies.",
        default="report.html",
        letter="o",
        metavar="FILE",
        kw_only=False,
    )
    clips: int | None = option(
        "How many cases can be seen in motion: the worst, median and best "
        "ones, of many kinds and pairs; 0: "
        "none.",
        default=None,
        shown="as many as fit 2 MB",
        at_least=0,
        metavar="N",
    )
    cases: Names = option("These cases in motion, too.", default=(), metavar="ID")
    columns: Names = option(
        "Values in the tables (bench info METRIC lists them).",
        default=(),
        shown="usual ones, and those of sets",
        metavar="ID,ID",
    )
    skins: bool = option("Skinned meshes in motion, where bodies have one; larger.", default=False)
    progress: bool = option("Show a progress bar.", default=True, python=True)

    @property
    def page(self) -> Path:
        return Path(self.out)


def write(
    options: ReportOptions,
    roots: Sequence[Path],
    *,
    task: str | None = None,
    dataset: str | None = None,
    only: Collection[ResultPaths] = (),
    variants: bool = False,
    over: Over = iter,
) -> PackedScenes:
    """Write the page of the results in some folders, and return the motion in it.

    only: of these results. variants: the first table has variants of methods. over: goes over what takes
    time. Raises BenchError where there are no results, for a name that ends in neither .html nor .pdf, and
    where motion is asked of a .pdf.
    """
    ending = options.page.suffix.lower()
    if ending not in (".html", ".htm", ".pdf"):
        raise BenchError(f"{options.page}: a report is a page; end its name in .html, or .pdf for a paper")
    if ending == ".pdf" and (options.clips or options.cases or options.skins):
        raise BenchError(
            f"{options.page} has no motion: leave out --clips, --cases and --skins, or write .html"
        )
    methods, columns = listed(options.methods), listed(options.columns)
    shown_chapters = chapters.chapters(
        roots, task, dataset, methods, options.root, columns, only, variants, over
    )
    if ending == ".pdf":
        sheet.write(options.page, [appendix(chapter) for chapter in shown_chapters])
        return PackedScenes()
    chosen = motions.chosen(
        shown_chapters, options.clips, [options.cases] if isinstance(options.cases, str) else options.cases
    )
    room = motions.ROOM if options.clips is None else motions.MOST_ROOM
    shown = motions.motions(shown_chapters, chosen, room, options.skins, over)
    ranked = method_order.ranked(chapters.results(roots))
    named = {label for each in shown_chapters for label in each.labels} if methods else ()
    files.write_text(options.page, page.page(shown_chapters, shown, ranked, named, over))
    return shown
