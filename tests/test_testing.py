"""The contract kit passes what is right, and each of its checks fails for what it is there for."""

from __future__ import annotations

from pathlib import Path

import pytest

from retarget_bench.commands.plugins import plugin_source
from retarget_bench.errors import BenchError
from retarget_bench.evaluation.tasks import points
from retarget_bench.methods import skr
from retarget_bench.plugins import registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.verification import contract
from retarget_bench.verification.contract import metrics as checks_of_metrics

METHODS = [entry.name for entry in registry.names("methods") if entry.origin == registry.BUILT_IN]
METHODS.remove("external")  # a program is to be named: engine/test_environments.py
SMALL = {"nearest_frame": "nearest_frame[poses=40]"}
"""Methods that take long by default, with parameters by which they do not."""
LONG = (
    *("correspondence_free", "npt", "nkn", "nkn_cross", "humot", "smrm", "nearest_frame"),
    *("other_clip", "footfix"),
)
"""Methods and post-processors that take a second or more: others meet the same demands sooner."""
POSTS = [entry.name for entry in registry.names("posts") if entry.origin == registry.BUILT_IN]
METRICS = [entry.name for entry in registry.names("metrics") if entry.origin == registry.BUILT_IN]
OF_MESHES = ("mesh_contact", "self_penetration", "vertex_error")
"""Metrics that look at every vertex, or every face, in every frame."""
TRIED = ("position", "rotation", "contact", "touch", "path_fitted", "fid_structure", "vertex_error")
"""Metrics of joints, of rotations, with labels, of touches, of pairs, of sets and of meshes."""


@pytest.fixture
def _few_points(monkeypatch) -> None:
    """Surfaces are known by few points: no demand is about how well they are."""
    monkeypatch.setattr(points, "COUNT", 128)
    monkeypatch.setattr(skr, "SPOTS", 128)


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow if name in LONG else ()) for name in METHODS],
)
@pytest.mark.usefixtures("_few_points")
def test_built_in_methods_keep_the_contract(name):
    if reason := getattr(registry.create("methods", name), "untrained", ""):
        pytest.skip(reason)
    contract.assert_contract("methods", SMALL.get(name, name))


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in TRIED else pytest.mark.slow) for name in METRICS],
)
def test_built_in_metrics_keep_the_contract(name, monkeypatch):
    if name in OF_MESHES:
        monkeypatch.setattr(checks_of_metrics, "LENGTH", 20)
    contract.assert_contract("metrics", name)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow if name in LONG else ()) for name in POSTS]
)
def test_built_in_post_processes_keep_the_contract(name):
    contract.assert_contract("posts", name)


def test_the_embedded_data_set_keeps_the_contract():
    contract.assert_contract("datasets", "puppets[size=tiny]")


# ----------------------------------------------------------------------- faults, each found by its check
@pytest.fixture
def bows(tmp_path, monkeypatch) -> str:
    """The template data set under a name of its own."""
    monkeypatch.setattr(registry, "_FILES", {})
    file = tmp_path / "bows.py"
    file.write_text(plugin_source("dataset", "bows"))
    registry.add_file(file)
    return "bows"


def plant(folder: Path, kind: str, change: dict[str, str], name: str = "faulty") -> str:
    """The template of a kind with a fault put in."""
    text = plugin_source(kind, name)
    for right, wrong in change.items():
        assert text.count(right) == 1, right
        text = text.replace(right, wrong)
    file = folder / f"{name}.py"
    file.write_text(text)
    registry.add_file(file)
    return name


def failures(kind: registry.Kind, name: str, data: str) -> dict[str, str]:
    return {each.demand: each.problem for each in contract.check(kind, name, data) if not each.passed}


API = "from retarget_bench.api import"
ANSWER = "return target.motion(copied.rotations, root, source.fps)"
REASON = "return transfer.reason(source, target)"
BATCH = f"""{REASON}

    def retarget_batch(self, sources, targets, *, contexts):
        each = zip(sources, targets, contexts, strict=True)
        found = [self.retarget(source, target, context=context) for source, target, context in each]
"""


def in_batches(line: str) -> dict[str, str]:
    """The template with a batch that ends in this line."""
    return {REASON: f"{BATCH}        {line}"}


METHOD_FAULTS = {
    "card without a line for a parameter": (
        {'parameters={"stride":': 'parameters={"width":'},
        "its card says",
        "no line for stride",
    ),
    "unknown privileged input": (
        {'version="1",': 'version="1", needs=("oracle",),'},
        "its card says",
        "oracle",
    ),
    "reason that is none": (
        {"return transfer.reason(source, target)": 'return ""'},
        "supports() gives",
        "returned ''",
    ),
    "frame too few": (
        {ANSWER: "return target.motion(copied.rotations[:-1], root[:-1], source.fps)"},
        "answers keep",
        "39 frames; the source has 40",
    ),
    "fixed rate": (
        {ANSWER: ANSWER.replace("source.fps", "30.0")},
        "another frame rate",
        "30 frames per second",
    ),
    "fails on one frame": (
        {ANSWER: "assert source.frames > 1, 'too short'; " + ANSWER},
        "a clip of one frame",
        "too short",
    ),
    "fails on positions": (
        {
            'raise NotSupported("faulty needs a source with rotations")': "source.rotations",
            'version="1",': 'version="1", accepts=("motion", "positions"),',
        },
        "a source known by positions",
        "AttributeError",
    ),
    "writes into the source": (
        {ANSWER: "source.root[0] += 1; " + ANSWER},
        "its input is not modified",
        "source.root",
    ),
    "global randomness": (
        {ANSWER: "import numpy; root += numpy.random.rand(); " + ANSWER},
        "same case and seed",
        "differ by up to",
    ),
    "remembers": (
        {ANSWER: "self.stride += 1; root += self.stride; " + ANSWER},
        "same case and seed",
        "differ by up to",
    ),
    "undeclared seed": (
        {"del context": "pass", ANSWER: "root = root + context.seed; " + ANSWER},
        "the seed matters only",
        "differ by up to",
    ),
    "peeks": (
        {"del context": "if context.reference is not None: return context.reference"},
        "privileged inputs",
        "card's needs does not name",
    ),
    "batch of another length": (in_batches("return found[1:]"), "asked in a batch", "answers to"),
    "batch that looks at its first case": (
        in_batches("return [replace(one, root=one.root + 1e-4 * found[0].root[0]) for one in found]")
        | {
            API: f"from dataclasses import replace\n{API}",
        },
        "asked in a batch",
        "joints are off by up to",
    ),
    "batch of one length": (
        in_batches("assert len({one.frames for one in found}) == 1, 'uneven'"),
        "asked in a batch",
        "uneven",
    ),
    "batch that is not a motion": (
        in_batches("return [None for _ in found]"),
        "asked in a batch",
        "NoneType",
    ),
}


def test_a_batch_that_answers_as_its_cases_alone_passes(tmp_path, bows):
    fine = in_batches("return [replace(one, root=one.root + 1e-6) for one in found]")
    fine |= {
        "from retarget_bench.api import": "from dataclasses import replace\nfrom retarget_bench.api import"
    }
    assert failures("methods", plant(tmp_path, "method", fine), bows) == {}


@pytest.mark.parametrize("fault", METHOD_FAULTS)
def test_a_faulty_method_fails_the_check_that_is_meant_for_it(tmp_path, bows, fault):
    change, demand, problem = METHOD_FAULTS[fault]
    problems = failures("methods", plant(tmp_path, "method", change), bows)
    (message,) = (text for name, text in problems.items() if name.startswith(demand))
    assert problem in message
    with pytest.raises(AssertionError, match="breaks its contract"):
        contract.assert_contract("methods", "faulty", bows)


VALUE = '{"faulty.mean": 100 * float(apart.mean()) / comparison.height}'
METRIC_FAULTS = {
    "no formula": (
        {'"100 * mean over frames of |p_y - g_y| / h; p, g: the head, h: target\'s height"': '" "'},
        "its card says",
        "faulty.mean has no formula",
    ),
    "unknown direction": ({'better="lower"': 'better="smaller"'}, "its card says", "smaller"),
    "not a number": ({VALUE: '{"faulty.mean": float("nan")}'}, "values are finite", "nan"),
    "undeclared": (
        {VALUE: VALUE[:-1] + ', "other": 1.0}'},
        "values are finite",
        "gave 'other', a value that its card does not declare",
    ),
    "number for a curve": (
        {'better="lower",': 'better="lower", index="joint",'},
        "values are finite",
        "instead of numbers by joint for faulty.mean",
    ),
    "nothing": ({VALUE: "{}"}, "values are finite", "no value at all"),
    "wrong way round": (
        {'better="lower"': 'better="higher"'},
        "the right answer is never worse",
        "faulty.mean",
    ),
    "fails on one frame": (
        {VALUE: '{"faulty.mean": float(np.diff(apart, axis=0).max())}'},
        "a clip of one frame",
        "ValueError",
    ),
    "needs rotations": (
        {VALUE: '{"faulty.mean": float(comparison.prediction.rotations.max())}'},
        "a prediction known by positions",
        "AttributeError",
    ),
    "writes into the prediction": (
        {"return " + VALUE: "comparison.prediction.root[0] += 1; return " + VALUE},
        "its input is not modified",
        "read-only",
    ),
    "random": (
        {"return " + VALUE: "return {'faulty.mean': np.random.rand()}"},
        "same input",
        "faulty.mean was",
    ),
}


@pytest.mark.parametrize("fault", METRIC_FAULTS)
def test_a_faulty_metric_fails_the_check_that_is_meant_for_it(tmp_path, bows, fault):
    change, demand, problem = METRIC_FAULTS[fault]
    problems = failures("metrics", plant(tmp_path, "metric", change), bows)
    (message,) = (text for name, text in problems.items() if name.startswith(demand))
    assert problem in message


OF_PAIRS = """
import numpy as np
from retarget_bench.api import MetricCard, Value

class Faulty:
    value = Value("faulty.mean", "faulty", "how far off", "m", "lower", formula="mean", source="ours")
    card = MetricCard("faulty", "Compares the clips of a pair", version="1", values=(value,))
    least = 2

    def extract(self, comparison):
        return comparison.distances.mean(axis=1)

    def values(self, clips):
        return [{"faulty.mean": each} for each in VALUES]

plugin = Faulty
"""


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        ("[float(np.concatenate(clips).mean())] * len(clips)", ""),
        ("[float(clips[0].mean())] * len(clips)", "with the clips in another order"),
        ("np.stack(clips).mean(axis=1).tolist()", "same shape"),
    ],
)
def test_a_metric_of_pairs_takes_clips_of_any_length_in_any_order(tmp_path, bows, values, problem):
    file = tmp_path / "faulty.py"
    file.write_text(OF_PAIRS.replace("VALUES", values))
    registry.add_file(file)
    problems = failures("metrics", "faulty", bows)
    (message,) = [text for name, text in problems.items() if "order of the clips" in name] or [""]
    assert set(problems.values()) == {message} - {""}
    assert problem in message


IDS = 'CaseInfo(f"faulty/{a}>{b}/{clip}", task, split, a, b, clip, frames=self.frames)'
DATA_FAULTS = {
    "no licence": ({'licence="CC0-1.0"': 'licence=""'}, "its card says", "no licence"),
    "label": ({'return "faulty"': "return 7"}, "label, content and notes", "label is 7"),
    "nothing": ({"for clip in CLIPS\n": "for clip in ()\n"}, "there is at least one case", "no case"),
    "same id twice": ({IDS: IDS.replace("{clip}", "clip")}, "case ids are unique", "is there twice"),
    "id without the pair": ({IDS: IDS.replace("{a}>{b}", "{b}>{a}")}, "case ids are unique", ">"),
    "changing content": (
        {'return f"version {self.card.version}, {self.frames} frames"': "return str(id(self))"},
        "built again",
        "content was",
    ),
    "wrong split": (
        {"split == usual_split(a == b": "split == usual_split(a != b"},
        "splits follow",
        "but is",
    ),
    "length": (
        {"frames=self.frames)": "frames=self.frames + 1)"},
        "loaded cases fit",
        "61 frames listed, 60 loaded",
    ),
    "rate": (
        {"reference=self._bow(target, CLIPS[info.clip])": "reference=self._bow(target, 0.1).resample(15)"},
        "loaded cases fit",
        "reference of 30 frames, source of 60",
    ),
    "other body": (
        {"target=target,": "target=self._characters['small'],"},
        "loaded cases fit",
        "another skeleton",
    ),
    "touch of other length": (
        {
            "reference=self._bow(target, CLIPS[info.clip])": (
                "reference=self._bow(target, CLIPS[info.clip]), touches=(__import__('retarget_bench').api."
                "Touch('head', np.zeros(3), 'hips', np.zeros(3), np.ones(7, dtype=bool)),)"
            )
        },
        "loaded cases fit",
        "a touch of shapes ((3,), (3,), (7,)), not (3,), (3,), (60,)",
    ),
    "touch of nobody's hand": (
        {
            "reference=self._bow(target, CLIPS[info.clip])": (
                "reference=self._bow(target, CLIPS[info.clip]), touches=(__import__('retarget_bench').api."
                "Touch('left_index_1', np.zeros(3), 'hips', np.zeros(3), np.ones(60, dtype=bool)),)"
            )
        },
        "loaded cases fit",
        "a touch of left_index_1, which the target does not have",
    ),
    "not unit": (
        {"rotations = np.tile(rotation.identity(),": "rotations = np.tile(2 * rotation.identity(),"},
        "loaded cases are finite",
        "not a unit quaternion",
    ),
    "random": (
        {"angle = depth *": "angle = depth * np.random.rand() *"},
        "a case loaded twice",
        "the sources differ",
    ),
    "the same real motion twice": (
        {
            "    def load(self, info": (
                "    def real(self, task, _):\n        return [*self.cases(task, 'intra')] * 2\n\n"
                "    def load(self, info"
            )
        },
        "real motion, where it is offered",
        "is offered twice",
    ),
}


@pytest.mark.parametrize("fault", DATA_FAULTS)
def test_a_faulty_data_set_fails_the_check_that_is_meant_for_it(tmp_path, monkeypatch, fault):
    monkeypatch.setattr(registry, "_FILES", {})
    change, demand, problem = DATA_FAULTS[fault]
    problems = failures("datasets", plant(tmp_path, "dataset", change), "")
    (message,) = (text for name, text in problems.items() if name.startswith(demand))
    assert problem in message


def test_what_cannot_be_built_is_an_error_and_no_failed_check(bows):
    with pytest.raises(BenchError, match="nothing_like_it"):
        list(contract.check("methods", "nothing_like_it", bows))


def test_a_data_set_without_cases_is_an_error_of_the_data(tmp_path, bows):
    plant(tmp_path, "dataset", {"for clip in CLIPS\n": "for clip in ()\n"}, "empty")
    with pytest.raises(BenchError, match="'empty' has no case"):
        list(contract.check("metrics", "position", "empty"))


@pytest.mark.parametrize(
    ("name", "folder"), [("mixamo", "mixamo_san"), ("folder", "lafan1"), ("folder", "dog")]
)
def test_data_sets_of_files_keep_the_contract(real_data, name, folder):
    if not (real_data / folder).is_dir():
        pytest.skip(f"no {folder} among the real motion data")
    contract.assert_contract("datasets", Spec(name, {"root": str(real_data / folder)}))


OF_SETS = """
import numpy as np
from retarget_bench.api import CaseFeatures, MetricCard, Value

class Faulty:
    value = Value("faulty.gap", "faulty", "how far apart", "m", "lower", formula="gap", source="ours")
    card = MetricCard("faulty", "Compares sets", version="1", values=(value,))
    distances = NAMES

    def features(self, comparison):
        both = comparison.predicted, comparison.expected
        generated, real = (each[:, 0].astype(np.float32) for each in both)
        return CaseFeatures(generated, real, np.ones(len(real), np.float32))

    def least(self, value_id):
        return 1

    def value(self, value_id, real, generated):
        return float(np.abs(real.features.mean() - generated.features.mean())) + OFFSET

plugin = Faulty
"""


@pytest.mark.parametrize(
    ("names", "offset", "problem"),
    [
        ('("faulty.gap",)', "0.0", ""),
        ("()", "1.0", ""),
        ('("faulty.gap",)', "1.0", "faulty.gap is 1.0 between equal sets"),
        ('("gap",)', "0.0", "gap is named among distances or unbiased values, and is no value of its card"),
    ],
)
def test_what_a_metric_of_sets_calls_a_distance_is_one(tmp_path, bows, names, offset, problem):
    file = tmp_path / "faulty.py"
    file.write_text(OF_SETS.replace("NAMES", names).replace("OFFSET", offset))
    registry.add_file(file)
    problems = failures("metrics", "faulty", bows)
    (message,) = [text for name, text in problems.items() if name.startswith("distances are")] or [""]
    assert set(problems.values()) == {message} - {""}
    assert problem in message
