"""Each probe sees the fault that it is for, and no other; what is off is told and stored."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from probe_questions import clips_together, short_questions

from retarget_bench.api import Case, CaseInfo, MethodCard
from retarget_bench.cli import main
from retarget_bench.motion import rotation
from retarget_bench.motion.motion import Motion
from retarget_bench.plugins.registry import create
from retarget_bench.plugins.spec import Spec
from retarget_bench.results import store
from retarget_bench.verification.probe import report
from retarget_bench.verification.probe.asking import NOT_ASKED, ask, dependence, spread
from retarget_bench.verification.probe.probes import PROBES, deviation

pytestmark = pytest.mark.usefixtures("in_process")

TOY_CASES = Path(__file__).parent / "toys" / "toy_cases.py"


@pytest.fixture(scope="module")
def subjects() -> list[Case]:
    return short_questions()


@pytest.fixture(scope="module")
def groups() -> list[list[Case]]:
    return clips_together()


# ------------------------------------------------------------------------------------- faults
class Fault:
    """copy_rotations with something wrong about it: ``change`` writes into its rotations and root."""

    card = MethodCard("fault", "broken on purpose", "1")

    def __init__(self, change: Callable[..., None] = lambda *_: None) -> None:
        self.sound, self.change = create("methods", Spec.parse("copy_rotations")), change

    def supports(self, source, target):
        return None

    def retarget(self, source, target, *, context):
        answer = self.sound.retarget(source, target, context=context)
        rotations, root = np.array(answer.rotations), np.array(answer.root)
        self.change(source, target, rotations, root)
        return target.motion(rotations, root, answer.fps)


def by_name(source, target, rotations, root):
    """Holds still what it does not know by name."""
    for joint, name in enumerate(target.skeleton.names):
        if name.startswith("j") or source.skeleton.names[0].startswith("j"):
            rotations[:, joint] = rotations[:1, joint]


def by_index(source, target, rotations, root):
    """Bends joint number 3, whatever it is."""
    rotations[:, 3] = rotation.multiply(rotations[:, 3], rotation.about(np.array([0, 1.0, 0]), 0.5)[None])


def raw_local(source, target, rotations, root):
    """Local rotations as they are in the file, by role: right only where rest poses are alike."""
    rotations[:] = rotation.identity(source.frames, len(target.skeleton))
    for role, joint in target.joint_of.items():
        if role in source.character.joint_of:
            rotations[:, joint] = source.rotations[:, source.character.joint_of[role]]
    root[:] = source.root * (target.height / source.character.height)


def root_as_it_is(source, target, rotations, root):
    root[:] = source.root


def centred(source, target, rotations, root):
    """Stays near where the stage is: the root's path is squeezed."""
    root[:, [0, 2]] = np.tanh(root[:, [0, 2]])


def right_handed(source, target, rotations, root):
    """Swings the right arm out."""
    joint = target.joint_of["right_arm"]
    swing = rotation.about(np.array([0.0, 0, 1.0]), 0.4)
    rotations[:, joint] = rotation.multiply(rotations[:, joint], swing[None])


def late(source, target, rotations, root):
    """One frame behind: remembers the past, and counts in frames."""
    held = np.maximum(np.arange(source.frames) - 1, 0)
    rotations[:], root[:] = rotations[held], root[held]


def blind(source, target, rotations, root):
    """The same dance for everybody."""
    rotations[:] = target.reference_pose
    joint = target.joint_of["left_arm"]
    swing = rotation.about(np.array([1.0, 0, 0]), np.sin(np.arange(source.frames) / 5.0)[:, None])
    rotations[:, joint] = rotation.multiply(rotations[:, joint], swing.reshape(-1, 4))
    root[:] = [0, target.measures.hip_height, 0]


FAULTS = {
    by_name: {"source_names", "target_names"},
    by_index: {"target_order", "target_axes", "target_rest", "target_split"},
    raw_local: {"source_axes", "target_axes", "source_rest", "target_rest"},
    root_as_it_is: {"source_scale", "target_scale"},
    centred: {"target_scale", "units", "shifted", "turned"},
    right_handed: {"mirrored"},
    late: {"rate_24", "rate_60", "rate_120", "reversed"},
    blind: {"turned"},
}


def off(method, subjects: list[Case]) -> set[str]:
    """The probes whose answer is not as it must be (or would be, of a method without memory)."""
    replies = ask(method, "fault", subjects)
    assert {reply.status for reply in replies} <= {"ok", NOT_ASKED}
    tolerance = {probe.id: probe.tolerance for probe in PROBES}
    return {r.probe for r in replies if r.number is not None and r.number > tolerance[r.probe]}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.__name__)
def test_each_fault_is_seen_by_its_probes(fault, subjects: list[Case]) -> None:
    findings = off(Fault(fault), subjects)
    assert FAULTS[fault] <= findings


@pytest.mark.parametrize("fault", [root_as_it_is, right_handed, late])
def test_a_fault_is_seen_by_no_other_probe(fault, subjects: list[Case]) -> None:
    side_effects = {
        right_handed: {"target_axes", "target_rest"},  # it swings about an axis of the joint
    }
    assert off(Fault(fault), subjects) <= FAULTS[fault] | side_effects.get(fault, set())


@pytest.mark.parametrize("name", ["copy_rotations", "bone_directions", "ik"])
def test_sound_methods_pass(name: str, subjects: list[Case], groups: list[list[Case]]) -> None:
    replies = ask(create("methods", Spec.parse(name)), name, subjects, groups)
    assert report.findings(name, replies) == []
    numbers = {name: [r.number for r in replies if r.probe == name] for name in ("correlation", "shuffled")}
    assert len(numbers["correlation"]) == len(numbers["shuffled"]) == len(groups)
    assert min(numbers["correlation"]) > 0.9
    assert all(0.7 < each < 1.3 for each in numbers["shuffled"])


def test_a_blind_method_is_told(groups: list[list[Case]]) -> None:
    replies = ask(Fault(blind), "blind", [], groups)
    (finding,) = [
        sentence for sentence in report.findings("blind", replies) if "hardly depends" in sentence
    ]
    assert "shuffled 0.00" in finding


# ------------------------------------------------------------------------------------- dependence by hand
def test_dependence_of_sources_themselves_is_whole(subjects: list[Case]) -> None:
    people = [s for s in subjects if s.source.character.structure == "body22"]
    same = people[0].source.character
    motions = [
        Motion(same, people[0].source.rotations * 0 + turned, people[0].source.root, 30.0)
        for turned in (rotation.about(np.array([1.0, 0, 0]), a) for a in (0.0, 0.1, 0.3, 0.7))
    ]
    itself = [(each, each) for each in motions]
    assert dependence(itself) == pytest.approx({"correlation": 1.0, "shuffled": 1.0})
    assert dependence(itself[:3]) == {}
    one_answer = dependence([(each, motions[0]) for each in motions])
    assert one_answer == {"correlation": 0.0, "shuffled": 0.0}


def test_deviation_is_in_per_cent_of_height(subjects: list[Case]) -> None:
    case = subjects[0]
    probe = next(probe for probe in PROBES if probe.id == "source_names")
    question = probe.ask(case.source, case.target)
    places = np.zeros((5, 3, 3))
    moved = places + np.array([0, 0.01 * case.target.height, 0])
    assert deviation(question, moved, places, case.target.height) == pytest.approx(1.0)


# ------------------------------------------------------------------------------------- the command
def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str]:
    return bench(capsys, "test", "--probes", "all", *arguments)


def test_rows_lie_beside_other_results(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = ("--out", str(tmp_path), "--limit", "4", "-s", "intra")
    code, output = run(capsys, "copy_rotations[root_rule=none]", "copy_rotations", *out)
    assert code == 1
    assert "copy_rotations[root_rule=none]: source_scale: off by" in output
    places = store.find_results(tmp_path, "probe")
    assert {(place.task, place.split) for place in places} == {("probe", "intra")}
    assert store.find_results(tmp_path) == []
    results = store.read_results(places[0])
    probed = [entry for entry in results.entries if "probe.mirrored" in entry.values]
    assert len(probed) == 4
    assert any("probe.correlation" in entry.values for entry in results.entries)
    assert run(capsys, "copy_rotations[root_rule=none]", *out)[0] == 1
    assert run(capsys, "copy_rotations", *out)[0] == 0


def bench(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str]:
    with pytest.raises(SystemExit) as stop:
        main([str(each) for each in arguments])
    out, err = capsys.readouterr()
    return int(stop.value.code or 0), out + err


def test_probes_have_a_table_of_their_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Results of probes lie in the same folder, and nothing that reads results takes them for such."""
    probed, both = tmp_path / "probed", tmp_path / "both"
    for root in (probed, both):
        out = ("--out", root, "--limit", 2, "-s", "intra", "-d", f"{TOY_CASES}[clips=4]")
        assert (
            bench(capsys, "test", "--probes", "turned,mirrored", "bone_directions", "rest_pose", *out)[0]
            == 1
        )
    where = ("-s", "intra", "--out", both, "-d", TOY_CASES)
    assert bench(capsys, "run", "bone_directions", "rest_pose", *where)[0] == 0
    code, output = bench(capsys, "table", "-r", both, "--all")
    assert (code, "probe" in output) == (0, False)
    code, output = bench(capsys, "table", "-r", both, "--task", "probe", "--all", "-f", "csv")
    heading, *rows = csv.reader(io.StringIO(output))
    assert (code, len(rows)) == (0, 2)
    ids = [name for name in heading if "." in name and ":" not in name]
    filled = [name for name, number in zip(heading, rows[0], strict=True) if name in ids and number]
    assert filled == ["probe.turned", "probe.mirrored", "probe.correlation", "probe.shuffled"]
    assert [name for name in ids if not name.startswith("probe.")] == []
    code, output = bench(capsys, "compare", "bone_directions", "rest_pose", "--results", both)
    assert (code, "probe" in output) == (0, False)
    for command in (
        ("table", "-r", probed),
        ("compare", "ik", "rest_pose", "--results", probed),
        ("table", "--protocols", "-r", probed),
    ):
        code, output = bench(capsys, *command)
        assert (code, "no results" in output) == (2, True), output
    assert (
        bench(capsys, "table", "-r", tmp_path / "x", "--task", "probe")[1].count("--probes makes some") == 1
    )


def test_what_cannot_be_asked_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = ("--out", str(tmp_path))
    code, output = run(capsys, "reference", *out)
    assert (code, "given reference" in output) == (2, True)
    code, output = bench(capsys, "test", "ik", "--probes", "sorce_names", *out)
    assert (code, "there are source_names" in output) == (2, True)
    assert not list(tmp_path.iterdir())


def test_what_a_method_declares_it_cannot_do_is_no_fault(subjects: list[Case]) -> None:
    class Choosy(Fault):
        def supports(self, source, target):
            return "only tall targets" if target.height < 1.0 else None

    class Nothing(Fault):
        def supports(self, source, target):
            return "I am not finished"

    replies = ask(Choosy(), "choosy", subjects)
    refused = [reply for reply in replies if reply.status == "unsupported"]
    assert 0 < len(refused) < len(subjects)
    assert report.findings("choosy", replies) == []
    (sentence,) = report.refusals("choosy", replies)
    assert sentence == f"choosy: does not answer {len(refused)} of {len(subjects)} cases: only tall targets"
    (sentence,) = report.findings("nothing", ask(Nothing(), "nothing", subjects))
    assert "no question was answered" in sentence


def test_cases_are_spread_evenly() -> None:
    infos = [CaseInfo(str(k), "retarget", "intra", "a", "b", "c") for k in range(100)]
    chosen = spread({"intra": infos, "cross": infos[:1]}, 6)
    assert [info.id for info in chosen] == ["16", "50", "83", "0"]
