"""One rule of colours: a method has that of its rank, in clips, live and pages as in reports and plots."""

from __future__ import annotations

from dataclasses import replace

from retarget_bench.commands.render import Options, scene_of
from retarget_bench.figures import method_order, palette
from retarget_bench.viewer import results_library, scene_builder
from retarget_bench.viewer.colours import names
from retarget_bench.viewer.scene_builder import CaseList
from tests.viewing.small_runs import CASE, ran


def test_methods_keep_the_colour_of_their_rank_whoever_is_shown_and_in_which_order(tmp_path):
    ran(tmp_path, "copy", "far")
    ranked = list(method_order.ranked(method_order.everything([tmp_path])))
    expected = {label: palette.COLOURS[place] for place, label in enumerate(ranked)}
    assert len(set(expected.values())) == 2
    for methods in ((), tuple(ranked), tuple(reversed(ranked)), ranked[1:]):
        scene = scene_of([CASE], Options(out=tmp_path / "unused.png", results=[tmp_path], methods=methods))
        shown = dict(zip([figure.label for figure in scene.figures], names(scene), strict=True))
        assert shown.pop("source") == palette.SOURCE
        assert shown.pop("reference") == palette.REFERENCE
        assert shown == {label: expected[label] for label in methods or ranked}
    case_list = CaseList([tmp_path])
    case_list.refresh()
    assert case_list.scene(CASE).colours == expected


def test_seeds_share_a_colour_and_who_has_no_rank_takes_one_that_is_free(tmp_path):
    places = ran(tmp_path, "copy", "far")
    having, case = results_library.case(places, CASE)
    scene = scene_builder.of_case(having, case)
    first, second = (figure.label for figure in scene.figures[2:])
    assert names(scene)[2:] == [palette.COLOURS[0], palette.COLOURS[1]], "by order where nobody ranked"
    seeded = replace(scene.figures[2], label=f"{first}, seed 2")
    ranked = replace(scene, figures=(*scene.figures, seeded), colours={first: palette.COLOURS[0]})
    assert second not in ranked.colours
    assert names(ranked)[2:] == [palette.COLOURS[0], palette.COLOURS[1], palette.COLOURS[0]]
