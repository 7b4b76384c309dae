"""``bench view``: the list of cases, what stands in the scene, and the page, without a browser."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from dataclasses import replace
from importlib.util import find_spec
from itertools import pairwise

import numpy as np
import pytest
from small_runs import CASE, HERE, OTHER, bvh_file, ran
from viewing_toys.toy_moves import body, moving

from retarget_bench import cli
from retarget_bench.errors import BenchError
from retarget_bench.results import journal, store
from retarget_bench.results.store import ResultPaths
from retarget_bench.viewer import live
from retarget_bench.viewer.bodies import Solid
from retarget_bench.viewer.models import AROUND, PROFILE, tube_faces, tubes
from retarget_bench.viewer.scene import figure_of
from retarget_bench.viewer.scene_builder import CaseList

needs_viser = pytest.mark.skipif(
    find_spec("viser") is None, reason="no viser: pip install 'retarget-bench[viz]'"
)


def as_if_running(place: ResultPaths, cases: list[str]) -> None:
    """Complete results as they were while only these cases were done, and the last line half written."""
    results = store.read_results(place)
    store.begin(place, replace(results.header, files={}), list(results.cases.values()))
    journal.open_journal(place, results.header.keys)
    for entry in results.entries:
        if entry.case in cases:
            journal.append_journal(place, entry)
    with place.journal.open("a") as file:
        file.write('{"case": "toy_mo')


def test_a_shelf_has_the_cases_of_finished_results(tmp_path):
    ran(tmp_path, "copy", "raise")
    case_list = CaseList([tmp_path])
    assert sorted(case_list.refresh()) == sorted([CASE, OTHER])
    labels = {figure.label for figure in case_list.scene(CASE).figures}
    assert labels == {"source", "reference", "toy_method", "toy_method[does=raise]"}
    only = CaseList([tmp_path], methods=["toy_method[does=raise]"])
    only.refresh()
    assert [figure.status for figure in only.scene(CASE).figures] == ["ok", "ok", "failed"]


def test_data_may_lie_elsewhere_than_usual(tmp_path, monkeypatch):
    ran(tmp_path, "copy")
    data_sets = []
    monkeypatch.setattr(
        "retarget_bench.viewer.scene_builder.of_stored",
        lambda told, case, data, colours: data_sets.append(data),
    )
    case_list = CaseList([tmp_path], root="elsewhere")
    case_list.refresh()
    case_list.scene(CASE)
    assert str(data_sets[0]) == "toy_moves[root=elsewhere]"


def test_new_cases_of_a_running_run_appear(tmp_path):
    finished, running = ran(tmp_path, "copy", "positions")
    as_if_running(running, [OTHER])
    assert CaseList([tmp_path], methods=["toy_method[does=positions]"]).refresh() == [OTHER]
    with pytest.raises(BenchError, match="no results of 'waltz'"):
        CaseList([tmp_path], methods=["waltz"]).refresh()
    finished.header.unlink()
    begun = CaseList([tmp_path])
    assert begun.refresh() == [OTHER]
    shown = begun.scene(OTHER).figures[2]
    assert (shown.label, shown.status) == ("toy_method[does=positions]", "ok")
    assert shown.positions is not None
    complete_lines, torn, _ = running.journal.read_text().rpartition('{"case": "toy_mo')
    assert torn
    lost = {"case": CASE, "status": "failed", "message": "no", "values": {}}
    running.journal.write_text(complete_lines + json.dumps(lost) + "\n")
    assert sorted(begun.refresh()) == sorted([CASE, OTHER])
    assert begun.scene(CASE).figures[2].message == "no"


def test_tubes_go_around_their_bones_and_face_outwards():
    ends = np.array(
        [[[0.0, 0, 0], [0, 2.0, 0]], [[1.0, 1, 1], [1.0, 1, 1]], [[3.0, 0, 0], [4.0, 1.0, -1.0]]]
    )
    radii = np.array([[0.3, 0.1], [0.2, 0.2], [0.25, 0.15]])
    points, faces = tubes(ends, radii).reshape(3, -1, 3), tube_faces(1)
    for bone in range(3):
        first, last = ends[bone]
        away = [np.linalg.norm(points[bone] - end, axis=1) for end in ends[bone]]
        near = np.minimum(away[0] / radii[bone, 0], away[1] / radii[bone, 1])
        assert np.allclose(near, 1.0, atol=0.02)
        corners = points[bone][faces].astype(float)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        volume = (corners[:, 0] * normal).sum() / 6
        length, (a, b) = np.linalg.norm(last - first), radii[bone]
        octagon = 4 * np.sin(np.pi / 4)  # its area, of radius 1
        cap = 0.7 * (1 + 0.71 + 0.71**2) / 3 + 0.3 * 0.71**2 / 3
        expected = octagon * (length * (a * a + a * b + b * b) / 3 + cap * (a**3 + b**3))
        assert volume == pytest.approx(expected, rel=1e-4)
    assert tube_faces(3).max() == 3 * AROUND * len(PROFILE) - 1


def test_figures_side_by_side_do_not_meet():
    solids = [Solid(figure_of(str(k), "motion", moving(body("a"), 5)), (0, 0, 0)) for k in range(4)]
    shifts = live.beside(solids)
    spans = [(solid.places + shift)[..., 0] for solid, shift in zip(solids, shifts, strict=True)]
    assert all(left.max() + 0.5 < right.min() for left, right in pairwise(spans))
    assert np.abs(shifts[:, 1:]).max() < 1e-9  # they face +Z: their left is +X


@needs_viser
def test_the_window_shows_what_was_chosen(tmp_path):
    ran(tmp_path, "copy", "raise", "positions")
    window = live.Window(CaseList([tmp_path]), 0)
    try:
        assert sorted(window.case.options) == sorted([CASE, OTHER])
        window.choose(CASE)
        assert len(window._actors) == 4  # what failed has no body
        assert window.at.max == 11
        window.seek(7)
        points = window._actors[1].parts[0].vertices
        assert np.allclose(points, window._actors[1].model.vertices(7)[0])
        assert "toy_method[does=raise]: failed, RuntimeError: out of ideas" in window.said.value
        assert "toy_method: error" in window.said.value
        gap = np.subtract(window._actors[1].parts[0].position, window._actors[0].parts[0].position)
        assert np.linalg.norm(gap) > 1
        window.overlay.value = True
        window.rebuild()
        assert not np.any([actor.parts[0].position for actor in window._actors])
        window._shown["source"].value = False
        window.rebuild()
        assert window._actors[0].solid.figure.label == "reference"
        assert window.frame == 7
        window.seek(99)
        assert window.frame == 11
        window.choose("gone")
        assert "no results of case 'gone'" in window.said.value
    finally:
        window.stop()


def bench_view(*arguments: str) -> subprocess.Popen:
    toy = str(HERE / "viewing_toys" / "toy_moves.py")
    command = [sys.executable, "-m", "retarget_bench", "view", *arguments, "--no-open", "-d", toy]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@needs_viser
def test_the_page_is_there_on_this_machine_alone_until_ctrl_c(tmp_path):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    process = bench_view(str(bvh_file(tmp_path / "walk.bvh", 6)), "--port", str(port))
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line == f"http://127.0.0.1:{port} shows it; Ctrl-C stops\n"
        with urllib.request.urlopen(f"http://127.0.0.1:{port}", timeout=20) as page:
            assert page.status == 200
            assert b"<html" in page.read().lower()
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
    finally:
        process.kill()
    assert (process.returncode, out) == (0, "stopped\n")
    assert "Traceback" not in err


@needs_viser
def test_pages_of_other_sites_are_refused(tmp_path):
    from websockets.exceptions import InvalidStatus
    from websockets.sync.client import connect

    def answered(**headers: str | None) -> int:
        with socket.create_connection(("127.0.0.1", port)) as pipe:
            try:
                origin = headers.pop("Origin", None)
                uri = f"ws://{headers.pop('Host', f'127.0.0.1:{port}')}"
                connect(uri, sock=pipe, origin=origin, subprotocols=["viser-v0.0.0"], proxy=None).close()
            except InvalidStatus as refusal:
                return refusal.response.status_code
        return 101

    window = live.Window(CaseList(files=[bvh_file(tmp_path / "walk.bvh", 6)]), 0)
    try:
        port = window.server.get_port()
        here, localhost = f"127.0.0.1:{port}", f"localhost:{port}"
        assert (
            answered(Origin=f"http://{here}")
            == answered(Host=localhost, Origin=f"http://{localhost}")
            == 101
        )
        for origin in ("http://evil.example", f"http://evil.example:{port}", "null", "", None):
            assert answered(Origin=origin) == 403, origin
        for other in (f"evil.example:{port}", "evil.example", f"127.0.0.1:{port + 1}"):
            assert answered(Host=other, Origin=f"http://{other}") == 403, other
        assert answered(Origin=f"http://{localhost}") == 403
        request = urllib.request.Request(window.url, headers={"Host": f"evil.example:{port}"})
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(request, timeout=20)
    finally:
        window.stop()


def refused(capsys, *arguments: str) -> str:
    with pytest.raises(SystemExit) as left:
        cli.main(["view", *arguments, "--no-open"])
    assert left.value.code == 2
    return capsys.readouterr().err


def test_without_viser_a_sentence_says_what_to_do(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(live, "find_spec", lambda name: None)
    message = refused(capsys, str(tmp_path))
    assert message == f"bench: {live.NO_VISER}\n"
    assert "pip install 'retarget-bench[viz]'" in message


@needs_viser
def test_what_cannot_be_shown_is_told_in_words(tmp_path, capsys):
    assert "there is no folder" in refused(capsys, "-r", str(tmp_path / "none"))
    assert "cannot be read" in refused(capsys, str(tmp_path / "none.bvh"))
    assert "no case is called 'waltz'" in refused(capsys, "waltz", "-r", str(tmp_path))
    with socket.socket() as busy:
        busy.bind(("127.0.0.1", 0))
        busy.listen()
        port = str(busy.getsockname()[1])
        message = refused(capsys, str(bvh_file(tmp_path / "a.bvh", 3)), "--port", port)
    assert f"port {port} cannot be used" in message
