"""Prediction workers: what travels by files arrives as it was; whatever comes back is looked at first."""

import json
import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from retarget_bench.api import Case, CaseInfo, Context
from retarget_bench.errors import NotSupported
from retarget_bench.evaluation.predict import Inputs, Outcome, context_for, predict
from retarget_bench.evaluation.prediction import answering, numpy_worker
from retarget_bench.evaluation.prediction import question_files as files
from retarget_bench.evaluation.prediction.answering import AnsweringLoop
from retarget_bench.evaluation.prediction.channel import Channel, Closed
from retarget_bench.evaluation.prediction.limits import LONGEST_LOG, PATIENCE, Limits
from retarget_bench.evaluation.prediction.workers import WorkerPool
from retarget_bench.motion.ground import Ground
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec

HERE = Path(__file__).parent


@pytest.fixture(scope="module", autouse=True)
def _plugins():
    for file in ("toys/toy_cases.py", "toys/toy_method.py", "red_team/impostor.py", "red_team/hostile.py"):
        registry.add_file(HERE / file)


@pytest.fixture
def pool(tmp_path):
    workers = WorkerPool(tmp_path / "workers", tmp_path, registry.files(), Limits(timeout=10.0))
    yield workers
    workers.close()


@pytest.fixture(scope="module")
def case() -> Case:
    data = bound.dataset(Spec("toy_cases")).built
    return data.load(data.cases("retarget", "intra")[0])


def asked(case: Case, **inputs) -> tuple[Case, Context]:
    data = bound.dataset(Spec("toy_cases")).built
    return case, context_for(Inputs(**{"needs": ("other_clips",), **inputs}), data, case, seed=5)


# ------------------------------------------------------------------------------------------ what travels
def puppet_case() -> Case:
    data = bound.dataset(Spec("puppets")).built
    return data.load(data.cases("retarget", "cross")[0])


def test_a_body_arrives_as_it_was(tmp_path):
    body = replace(puppet_case().target, hinges={"left_leg": np.array([1.0, 0.0, 1e-17])})
    body = replace(body, whole=puppet_case().source.character)
    path = files.write_character(tmp_path, "token", body)
    assert files.write_character(tmp_path, "token", body) == path
    again = files.read_character(path)
    assert files.character_facts(again) == {
        **files.character_facts(body),
        "skinned": False,
        "whole": None,
    } | {"whole": files.character_facts(again)["whole"]}
    for name in ("offsets", "parents"):
        assert np.array_equal(getattr(again.skeleton, name), getattr(body.skeleton, name))
    assert np.array_equal(again.reference_pose, body.reference_pose)
    assert again.measures == body.measures
    assert again.whole is not None
    assert again.whole.skeleton.same_as(body.whole.skeleton)
    assert np.array_equal(again.hinge("left_leg"), body.hinge("left_leg"))
    assert again.skeleton.end_sites == body.skeleton.end_sites


@pytest.mark.parametrize("kind", ["motion", "positions"])
def test_a_motion_arrives_to_the_last_bit(tmp_path, kind):
    source = puppet_case().source
    if kind == "positions":
        source = source.character.positions(source.positions, 59.94)
    again = files.read_motion(files.write_motion(tmp_path, "token", source), source.character)
    assert type(again) is type(source)
    assert again.fps == source.fps
    for name in source.arrays:
        assert np.array_equal(getattr(again, name), getattr(source, name))


def test_a_ground_arrives_as_it_was():
    uneven = Ground(heights=np.array([[0.0, 1 / 3], [2.0, 3.0]]), origin=(0.5, -1.0), spacing=0.25)
    for ground in (Ground(), Ground(0.1), uneven):
        again = files.ground(json.loads(json.dumps(files.ground_facts(ground))))
        assert (again.height, again.origin, again.spacing) == (ground.height, ground.origin, ground.spacing)
        assert (
            again.heights is None
            if ground.heights is None
            else np.array_equal(again.heights, uneven.heights)
        )


def test_training_motion_arrives_as_it_was(tmp_path):
    data = bound.dataset(Spec("puppets")).built
    structure, members = next(iter(data.training().items()))
    name = next(iter(members))
    cast = {structure: {name: members[name]}}
    index = files.write_training(tmp_path, "token", cast)
    again = files.read_training(index, lambda body: files.read_character(Path(body)))
    clips = again[structure][name]
    assert list(clips.names) == list(members[name].names)
    assert len(clips) == len(members[name])
    for one, two in zip(clips, (members[name][n] for n in range(len(clips))), strict=True):
        assert np.array_equal(one.rotations, two.rotations)
        assert np.array_equal(one.root, two.root)


@settings(max_examples=30)
@given(
    st.recursive(
        st.none() | st.integers() | st.text(), lambda x: st.lists(x) | st.dictionaries(st.text(), x)
    )
)
def test_lines_arrive_as_they_were(message):
    reading, writing = os.pipe()
    channel = Channel(reading, writing)
    try:
        channel.send({"said": message})
        channel.send({"next": 1})
        assert channel.receive(1.0) == {"said": message}
        assert channel.receive(1.0) == {"next": 1}
        assert channel.receive(0.0) is None
    finally:
        channel.close()


def test_a_line_that_is_cut_is_no_line():
    reading, writing = os.pipe()
    os.write(writing, b'{"said": 1')
    channel = Channel(reading, writing)
    assert channel.receive(0.05) is None
    os.close(writing)
    with pytest.raises(Closed):
        channel.receive(1.0)
    os.close(reading)


# ------------------------------------------------------------------------------------------ what comes back
@pytest.mark.parametrize("name", ["copy_rotations", "toy_method[does=noise]", "toy_method[does=positions]"])
def test_an_answer_is_that_of_the_method_here(pool, case, name):
    (reply,) = pool.worker(Spec.parse(name)).ask([asked(case)])
    here = predict(registry.create("methods", name), *asked(case)).prediction
    for array in here.arrays:
        assert np.array_equal(getattr(reply.prediction, array), getattr(here, array).astype(np.float32))
    assert reply.prediction.character is case.target


def test_privileged_motions_are_handed_over_when_they_are_looked_at(pool, case):
    (peeked,) = pool.worker(Spec.parse("toy_method[does=peek]")).ask([asked(case, needs=("reference",))])
    assert np.allclose(peeked.prediction.root, case.reference.root, atol=1e-6)
    (other,) = pool.worker(Spec("other_clip")).ask([asked(case)])
    assert other.status == "ok"
    (far,) = pool.worker(Spec.parse("impostor[does=far]")).ask([asked(case)])
    assert far.status == "failed"
    assert "IndexError" in far.message


@pytest.mark.parametrize(
    ("does", "status", "words"),
    [
        ("link", "invalid", "not an ordinary file"),
        ("pipe", "invalid", "not an ordinary file"),
        ("folder", "invalid", "not an ordinary file"),
        ("nothing", "invalid", "is not there"),
        ("pickle", "invalid", "Object arrays"),
        ("bomb", "invalid", "are plenty for 12 frames"),
        ("babble", "failed", "where an answer is due"),
        ("array", "failed", "where an answer is due"),
        ("short", "failed", "does not answer as it should"),
        ("wishes", "failed", "asks for what there is not"),
        ("unbuilt", "failed", "no such thing"),
        ("leaves_at_once", "failed", "exit code 4"),
        ("exit", "failed", "SystemExit: out of here"),
        ("unreadable", "failed", "Odd: no message that can be read"),
        ("surrogate", "failed", "half a character: \\ud800"),
    ],
)
def test_whatever_else_comes_is_a_status(pool, case, tmp_path, does, status, words):
    secret = tmp_path / "secret.npz"
    np.savez(secret, rotations=case.reference.rotations, root=case.reference.root, fps=30.0)
    worker = pool.worker(Spec("impostor", {"does": does, "note": str(secret)}))
    (reply,) = worker.ask([asked(case)])
    assert (reply.status, reply.prediction) == (status, None)
    assert words in reply.message
    assert secret.exists()


def test_no_file_of_a_question_stays(pool, case):
    for method in ("reference", "other_clip"):
        asked_here = asked(case, needs=("reference", "other_clips"))
        assert pool.worker(Spec(method)).ask([asked_here])[0].status == "ok"
        assert not list(pool.worker(Spec(method)).folder.glob("*.npz"))


def test_a_process_that_somebody_killed_is_asked_again(pool, case, tmp_path):
    worker = pool.worker(Spec("impostor", {"does": "once", "note": str(tmp_path / "died")}))
    assert [each.status for each in worker.ask([asked(case)])] == ["ok"]
    assert (tmp_path / "died").exists()


def test_a_method_that_never_answers_is_given_up(tmp_path, case):
    pool = WorkerPool(tmp_path / "workers", tmp_path, registry.files(), Limits(timeout=0.3))
    try:
        worker = pool.worker(Spec("impostor", {"does": "slow_once", "note": str(tmp_path / "times")}))
        messages = [worker.ask([asked(case)])[0].message for _ in range(3)]
        assert [message.startswith("no answer within 0.3 s") for message in messages] == [True, True, False]
        hanging = pool.worker(Spec.parse("hostile[does=hang]"))
        messages = [hanging.ask([asked(case)])[0].message for _ in range(PATIENCE + 1)]
        assert all(message.startswith("no answer within 0.3 s") for message in messages[:-1])
        assert messages[-1].startswith("not asked: 3 cases before this got no answer within 0.3 s")
    finally:
        pool.close()


def test_what_a_hanging_method_prints_is_kept_up_to_a_limit(tmp_path, case):
    pool = WorkerPool(tmp_path / "workers", tmp_path, registry.files(), Limits(timeout=1.0))
    try:
        for does, words in (("words", b"step 3"), ("flood", b"xxxx")):
            worker = pool.worker(Spec("impostor", {"does": does}))
            worker.log = tmp_path / f"{does}.log"
            assert "no answer" in worker.ask([asked(case)])[0].message
            assert worker.log.read_bytes().startswith(words)
            assert worker.log.stat().st_size < LONGEST_LOG + 100
            assert sum(each.stat().st_size for each in worker.folder.iterdir()) < 2**29
    finally:
        pool.close()


def test_a_method_that_removes_the_folder_of_its_questions_harms_itself(pool, case):
    worker = pool.worker(Spec("impostor", {"does": "no_folder"}))
    replies = [worker.ask([asked(case)])[0] for _ in range(4)]
    assert {each.status for each in replies} == {"failed"}
    assert "RuntimeError: gone" in replies[0].message
    assert all("gone" in each.message or "was changed" in each.message for each in replies)
    assert pool.worker(Spec("copy_rotations")).ask([asked(case)])[0].status == "ok"


@pytest.mark.skipif(sys.platform != "linux", reason="a process finds such children on Linux alone")
def test_what_a_method_leaves_behind_ends_with_it(pool, case):
    seconds = f"{4000 + os.getpid() % 1000}.125"
    worker = pool.worker(Spec("impostor", {"does": "daemon", "note": seconds}))
    assert worker.ask([asked(case)])[0].status == "ok"

    def there() -> list[psutil.Process]:
        return [
            each for each in psutil.process_iter(["cmdline"]) if seconds in (each.info["cmdline"] or ())
        ]

    assert worker.pid
    assert not there()


def forking(path):
    """A function that two processes come back from, and one that says in the file which came to write."""
    children = []

    def fork(*_):
        if child := os.fork():
            children.append(child)
            os.waitpid(child, 0)  # so the child would write first
        return {}

    def write(*_):
        with path.open("a") as file:
            file.write(f"{os.getpid()}\n")

    return fork, write


def test_of_two_processes_that_come_back_one_writes_the_answer(tmp_path, monkeypatch):
    fork, write = forking(tmp_path / "written")
    ended = Outcome("ok", prediction=object())
    monkeypatch.setattr(AnsweringLoop, "_case", lambda *_: None)
    monkeypatch.setattr(AnsweringLoop, "_context", lambda *_: None)
    monkeypatch.setattr(answering, "predict", lambda *_: fork() or ended)
    monkeypatch.setattr(files, "write_answer", write)
    reading, writing = os.pipe()
    channel = Channel(reading, writing)
    AnsweringLoop(None, channel, tmp_path)._answer([{"answer": "answer.npz"}])
    assert channel.receive(1.0)["answers"][0]["status"] == "ok"
    assert channel.receive(0.1) is None
    assert (tmp_path / "written").read_text().split() == [str(os.getpid())]


def test_so_it_is_in_a_worker_that_has_numpy_alone(tmp_path, monkeypatch):
    fork, write = forking(tmp_path / "written")
    for name in ("motion", "body"):
        monkeypatch.setattr(numpy_worker, name, lambda *_: {})
    monkeypatch.setattr(numpy_worker, "write", write)
    question = {"context": {}, "source": "", "source_character": "", "target_character": "", "answer": ""}
    assert numpy_worker.answer(question, fork, {})["status"] == "ok"
    assert (tmp_path / "written").read_text().split() == [str(os.getpid())]


def test_what_a_data_set_cannot_give_is_unsupported(pool, case):
    class Nothing:
        def __len__(self):
            return 1

        def __getitem__(self, index):
            raise NotSupported("needs reference motions, and this data set has none")

    context = replace(asked(case)[1], other_clips=Nothing())
    (reply,) = pool.worker(Spec("other_clip")).ask([(case, context)])
    assert (reply.status, reply.message) == (
        "unsupported",
        "needs reference motions, and this data set has none",
    )


def test_a_method_is_not_told_which_case_it_is_asked(pool, case, tmp_path, monkeypatch):
    monkeypatch.setattr(registry, "_FILES", dict(registry._FILES))
    spy = tmp_path / "spy.py"
    spy.write_text(
        "import json, os, sys\n"
        "from retarget_bench.api import MethodCard\n"
        "class Spy:\n"
        "    card = MethodCard(name='spy', summary='tells', version='1')\n"
        "    def supports(self, source, target): return None\n"
        "    def retarget(self, source, target, *, context):\n"
        "        frame, seen = sys._getframe(), []\n"
        "        while frame:\n"
        "            seen += [repr(each) for each in frame.f_locals.values()]\n"
        "            frame = frame.f_back\n"
        "        raise RuntimeError(str(any('clip 0' in each for each in seen)))\n"
        "plugin = Spy\n"
    )
    registry.add_file(spy)
    pool.plugins = registry.files()
    info = CaseInfo("toy/tall>small/clip 0", "retarget", "intra", "tall", "small", "clip 0")
    (reply,) = pool.worker(Spec("spy")).ask([asked(replace(case, info=info))])
    assert reply.message.startswith("RuntimeError: False")


def test_time_limits_grow_with_the_frames(case):
    assert Limits().seconds([case]) == 60.0 + case.source.frames
    assert Limits(timeout=2.0).seconds([case, case]) == 4.0
