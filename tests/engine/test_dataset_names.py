"""Two folders of one data set: told apart wherever data sets are named, and chosen by ``-d``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from small_plans import asked
from stored import store

from retarget_bench.analysis.selection import of_dataset
from retarget_bench.analysis.summary import split_summaries
from retarget_bench.cli import group
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import runner
from retarget_bench.motion import bvh
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.report import chapters
from retarget_bench.results.store import ResultPaths
from tests.in_process import without_processes

TOYS = Path(__file__).parent / "toys"
VALUE = "mpjpe_h.world"


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Spec]]:
    """Results on two folders of the same name, each with one clip, and their specs."""
    root = tmp_path_factory.mktemp("two")
    registry.add_file(TOYS / "toy_cases.py")
    toys = bound.dataset(Spec("toy_cases")).built
    specs = []
    for info, where in zip(toys.cases("retarget", "intra"), ("a", "b"), strict=False):
        bvh.write(root / where / "walks" / "clip.bvh", toys.load(info).source, scale=100.0)
        specs.append(registry.canonical("datasets", Spec("folder", {"root": str(root / where / "walks")})))
    with without_processes():
        plan = asked(root / "runs", "copy_rotations", datasets=tuple(specs), splits=("self",))
        places = runner.run(plan, lambda done, total: None)
    assert len(places) == 2
    return root / "runs", specs


def places(root: Path) -> list[ResultPaths]:
    from retarget_bench.results.store import find_results

    return find_results(root)


def bench(*arguments: object) -> str:
    result = CliRunner().invoke(group, list(map(str, arguments)), catch_exceptions=False)
    assert result.exit_code == 0
    return result.output


def test_one_alone_goes_by_its_label(two: tuple[Path, list[Spec]]) -> None:
    root, (spec, _) = two
    (alone,) = split_summaries(of_dataset(places(root), str(spec)))
    assert alone.dataset == "folder walks"


def test_tables_explanations_and_reports_name_both(two: tuple[Path, list[Spec]]) -> None:
    root, specs = two
    names = [f"folder walks ({bound.dataset(spec).slug})" for spec in specs]
    assert all(name in bench("table", "-r", root) for name in names)
    assert all(name in bench("table", "--protocols", "-r", root) for name in names)
    titles = {chapter.title for chapter in chapters.chapters([root])}
    assert titles == {f"{name}: people" for name in names}


def test_a_data_set_is_chosen_by_whatever_names_it(two: tuple[Path, list[Spec]]) -> None:
    root, specs = two
    all_places = places(root)
    for spec, place in (
        (spec, p) for spec in specs for p in all_places if p.dataset == bound.dataset(spec).slug
    ):
        for name in (place.dataset, f"folder walks ({place.dataset})", str(spec)):
            assert of_dataset(all_places, name) == [place]
        assert place.dataset not in bench("table", "-r", root, "-d", str(spec))
    for name in ("folder walks", "folder"):
        assert of_dataset(all_places, name) == all_places
    with pytest.raises(
        BenchError, match=rf"of folder\[root=c\] in .*{all_places[0].dataset} \(folder walks\)"
    ):
        of_dataset(all_places, "folder[root=c]")


def test_newer_data_of_one_folder_still_replace_older_ones(tmp_path: Path) -> None:
    """What has one folder is one data set, whose contents may change."""
    place = store(tmp_path, "cross", "m", [("ann>bo", "c1", {VALUE: 1.0})])
    elsewhere = replace(place, root=tmp_path / "other")
    store(elsewhere.root, "cross", "m", [("ann>bo", "c1", {VALUE: 2.0})])
    assert {each.dataset for each in split_summaries([place, elsewhere])} == {"data"}
