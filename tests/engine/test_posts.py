"""Methods followed by post-processors: rows, keys, what is inherited, and what becomes of a fault."""

from __future__ import annotations

import json
from types import MappingProxyType

import numpy as np
import pytest
from small_plans import asked, carry_out

from retarget_bench.analysis import summary
from retarget_bench.api import Context, Method, MethodCard
from retarget_bench.api.completing import complete
from retarget_bench.errors import BenchError
from retarget_bench.evaluation import plan as plans
from retarget_bench.plugins import registry
from retarget_bench.plugins.post_processors import Composed
from retarget_bench.results import predictions, store

pytestmark = pytest.mark.usefixtures("in_process", "toys")


def roots(results: store.Results) -> dict[str, np.ndarray]:
    """Case -> the predicted root path, in single precision."""
    by_case = {}
    for entry in results.entries:
        with np.load(results.paths.prediction(entry.case)) as file:
            by_case[entry.case] = file["root"]
    return by_case


# ----------------------------------------------------------------------------------------- what is done
def test_every_answer_goes_through_them_in_their_order(tmp_path):
    plain, lifted, both, other_way = carry_out(
        tmp_path,
        "toy_method",
        "toy_method+toy_post[by=0.25]",
        "toy_method+toy_post[by=0.25]+toy_post[does=double]",
        "toy_method+toy_post[does=double]+toy_post[by=0.25]",
    )
    up = np.array([0.0, 0.25, 0.0], np.float32)
    for case, root in roots(plain).items():
        assert roots(lifted)[case] == pytest.approx(root + up, abs=1e-6)
        assert roots(both)[case] == pytest.approx(2 * (root + up), abs=1e-6)
        assert roots(other_way)[case] == pytest.approx(2 * root + up, abs=1e-6)


def test_a_stochastic_method_draws_as_it_does_alone(tmp_path):
    plain, lifted = carry_out(
        tmp_path, "toy_method[does=noise]", "toy_method[does=noise]+toy_post[by=1]", seed=3
    )
    for case, root in roots(plain).items():
        assert roots(lifted)[case] == pytest.approx(root + np.array([0, 1, 0], np.float32), abs=1e-6)


def test_batches_stay_batches(tmp_path):
    plain, same, lifted = carry_out(
        tmp_path, "toy_batches", "toy_batches+toy_post", "toy_batches+toy_post[by=0.5]"
    )
    assert plain.paths.rows.read_bytes() == same.paths.rows.read_bytes()
    offs = {case: root - roots(lifted)[case] for case, root in roots(plain).items()}
    assert all(off == pytest.approx(np.tile([0, -0.5, 0], (12, 1)), abs=1e-6) for off in offs.values())
    built = registry.create("methods", "toy_batches+toy_post")
    assert built.retarget_batch is not None
    assert registry.create("methods", "toy_method+toy_post").retarget_batch is None


@pytest.mark.parametrize("method", ["reference", "toy_method[does=peek]", "toy_method"])
def test_they_see_the_floor_and_nothing_privileged(tmp_path, method):
    (results,) = carry_out(tmp_path, f"{method}+toy_post[does=look]")
    assert results.header.counts.ok == 6


# --------------------------------------------------------------------------------- what rows are known by
def test_rows_say_what_was_done(tmp_path):
    (results,) = carry_out(tmp_path, "toy_method+toy_post[by=0.5,does=lift]")
    method = results.header.method
    assert method.label == "toy_method+toy_post[by=0.5]"
    assert method.name == "toy_method"
    assert method.version == "1, toy_post 7"
    (post,) = method.posts
    assert (post["name"], post["version"], post["parameters"]) == ("toy_post", "7", {"by": 0.5})
    assert post["origin"].endswith("toy_post.py")
    (section,) = summary.split_summaries([results.paths])
    assert [score.label for score in section.scores] == ["toy_method+toy_post[by=0.5]"]


def test_privilege_and_control_are_inherited(tmp_path):
    peeking, control = carry_out(tmp_path, "toy_method[does=peek]+toy_post", "reference+toy_post[by=0.1]")
    assert peeking.header.method.privileged == ("reference",)
    assert control.header.method.control
    (section,) = summary.split_summaries([peeking.paths, control.paths])
    assert {score.unranked for score in section.scores} == {"sees reference", "control"}


def test_chance_is_inherited_from_either_side():
    for spec, chance in (
        ("toy_method+toy_post", False),
        ("toy_method[does=noise]+toy_post", True),
        ("toy_method+toy_post[does=noise]", True),
    ):
        assert registry.create("methods", spec).card.stochastic is chance


def test_what_learned_methods_say_of_themselves_is_passed_on():
    class Taught:
        card = MethodCard("taught", "learned", "2", accepts=("motion", "positions"))
        weights_hash, weights_label = "abc", "local-abc"
        training_manifest = MappingProxyType({"characters": ["tall"]})

    built = Composed(complete(Taught(), Method), [registry.create("posts", "toy_post")])
    assert (built.weights_hash, built.weights_label) == ("abc", "local-abc")
    assert built.training_manifest == {"characters": ["tall"]}
    assert built.card.accepts == ("motion", "positions")


def test_keys_differ_with_the_post_processes_and_not_without(tmp_path):
    texts = (
        "toy_method",
        "toy_method+toy_post",
        "toy_method+toy_post[by=1]",
        "toy_method+toy_post+toy_post",
        "toy_method+toy_post[by=1.0,does=lift]",
    )
    units = [plans.evaluation_units(asked(tmp_path, text))[0] for text in texts]
    keys = [cell.keys["prediction_key"] for cell in units]
    assert len(set(keys)) == 4
    assert keys[2] == keys[4]
    assert units[2].paths == units[4].paths
    assert "posts" not in units[0].prediction_facts


# ------------------------------------------------------------------------------------------------ faults
@pytest.mark.parametrize(
    ("method", "status", "words"),
    [
        ("toy_method+toy_post[does=short]", "invalid", "toy_post returned 11 frames; the source has 12"),
        ("toy_method[does=short]+toy_post", "invalid", "returned 11 frames; the source has 12"),
        ("toy_method+toy_post[does=raise]", "failed", "RuntimeError: no idea (toy_post.py:"),
        (
            "toy_method[does=positions]+toy_post",
            "unsupported",
            "toy_post takes motion, but toy_method gives positions only",
        ),
        (
            "toy_method+toy_post[does=picky]",
            "unsupported",
            "toy_post takes positions, but toy_method gives motion only",
        ),
        ("toy_batches+toy_post[does=short]", "invalid", "toy_post returned 11 frames"),
    ],
)
def test_a_fault_costs_its_row_and_names_who_it_is(tmp_path, method, status, words):
    (results,) = carry_out(tmp_path, method)
    assert {entry.status for entry in results.entries} == {status}
    assert all(words in entry.message for entry in results.entries)


def test_what_either_refuses_is_refused(tmp_path):
    for method in ("toy_method+toy_post[does=refuse]", "toy_method[does=picky]+toy_post"):
        (results,) = carry_out(tmp_path / method, method)
        refused = {e.case: e.message for e in results.entries if e.status == "unsupported"}
        assert len(refused) == 3
        assert all("small" in case and "only know tall" in why for case, why in refused.items())


def test_nobody_can_change_what_others_are_given(tmp_path):
    plain, after = carry_out(tmp_path, "toy_method", "toy_method+toy_post[does=overwrite]+toy_post")
    assert all(not root.any() for root in roots(after).values())
    again, _ = carry_out(tmp_path, "toy_method", "toy_method+toy_post[does=overwrite]", overwrite="always")
    assert again.paths.rows.read_bytes() == plain.paths.rows.read_bytes()


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("toy_method+toy_pots", "no post-processor is called 'toy_pots'; did you mean toy_post?"),
        ("toy_method+toy_method", r"\(toy_method is a method\)"),
        ("toy_post", r"no method is called 'toy_post'.*\(toy_post is a post-processor\)"),
        ("toy_method+toy_post[high=1]", "toy_post has no parameter 'high'"),
    ],
)
def test_wrong_names_are_answered_with_a_sentence(spec, words):
    with pytest.raises(BenchError, match=words):
        registry.create("methods", spec)


def test_only_methods_are_followed_by_anything():
    with pytest.raises(BenchError, match="post-processors follow a method, and this is a data set"):
        registry.create("datasets", "toy_cases+toy_post")
    with pytest.raises(BenchError, match="post-processors follow a method, and this is a metric"):
        registry.create("metrics", "position+toy_post")


def test_a_folder_made_elsewhere_may_be_called_so(tmp_path):
    folder = tmp_path / "theirs"
    folder.mkdir()
    data = registry.create("datasets", "toy_cases")
    for info in data.cases("retarget", "intra"):
        answer = registry.create("methods", "toy_method").retarget(
            data.load(info).source, data.load(info).target, context=Context()
        )
        predictions.write_prediction(folder / f"{store.case_file(info.id)}.npz", answer, "")
    (results,) = carry_out(tmp_path, "pan+their_own[n=2]", stage="score", external=folder)
    header = json.loads(results.paths.header.read_text())
    assert header["counts"]["ok"] == 6
    assert header["method"]["label"] == "pan+their_own[n=2]"
    assert header["method"]["posts"] == [{"name": "their_own", "parameters": {"n": 2}}]
