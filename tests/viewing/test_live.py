"""``bench view``: the list of cases, what stands in the scene, and the page, without a browser."""

from __future__ import annotations

import json
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from dataclasses import replace
from urllib.parse import quote

import pytest
from small_runs import CASE, HERE, OTHER, bvh_file, ran

from retarget_bench import cli
from retarget_bench.errors import BenchError
from retarget_bench.results import journal, store
from retarget_bench.results.store import ResultPaths
from retarget_bench.viewer import live
from retarget_bench.viewer import scene as scenes
from retarget_bench.viewer.scene import Scene, figure_of
from retarget_bench.viewer.scene_builder import CaseList
from tests.motion.tubes import fleshed, hand_to_belly


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


@pytest.fixture
def serving():
    """``serving(case_list, case)``: the address of a window, which is served until the test ends."""
    windows = []

    def served(case_list: CaseList, case: str | None = None) -> str:
        windows.append(live.Window(case_list, 0, case))
        threading.Thread(target=windows[-1].serve_forever, args=(0.05,), daemon=True).start()
        return windows[-1].url

    yield served
    for window in windows:
        window.shutdown()
        window.server_close()


def asked(url: str, **headers: str) -> tuple[int, bytes]:
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=30) as answer:
            return answer.status, answer.read()
    except urllib.error.HTTPError as refusal:
        return refusal.code, refusal.read()


def test_the_server_answers_what_the_page_asks_for(tmp_path, serving):
    ran(tmp_path, "copy", "raise")
    url = serving(CaseList([tmp_path]), OTHER)
    cases = json.loads(asked(f"{url}/cases")[1])
    assert (sorted(cases["cases"]), cases["first"], cases["problem"]) == (sorted([CASE, OTHER]), OTHER, "")
    before = cases["cases"]
    assert json.loads(asked(f"{url}/cases")[1])["cases"] == before
    scene = json.loads(asked(f"{url}/scene?case={quote(CASE)}")[1])
    assert [each["label"] for each in scene["figures"]] == [
        "source", "reference", "toy_method", "toy_method[does=raise]",
    ]  # fmt: skip
    assert json.loads(asked(f"{url}/inside?case={quote(CASE)}&figure=1&frame=0")[1]) == []
    assert asked(f"{url}/scene?case=gone") == (409, b"there are no results of case 'gone' any more")
    assert asked(f"{url}/inside?case={quote(CASE)}&figure=9&frame=0")[0] == 404
    assert asked(f"{url}/../etc/passwd")[0] == 404
    state = asked(f"{url}/state")
    (prediction,) = tmp_path.rglob(f"toy_method/{store.case_file(CASE)}.npz")
    prediction.unlink()
    assert asked(f"{url}/state") != state
    after = json.loads(asked(f"{url}/cases")[1])["cases"]
    assert after[CASE] != before[CASE]
    assert after[OTHER] == before[OTHER], "what has not changed is not shown anew"


@pytest.mark.parametrize("request_", [b"GET http://[bad HTTP/1.1\r\nHost: {}\r\n\r\n", b"GET /cases HTT"])
def test_odd_requests_and_those_that_end_early_are_no_tracebacks(tmp_path, serving, capsys, request_):
    host = serving(CaseList(files=[bvh_file(tmp_path / "walk.bvh", 6)])).removeprefix("http://")
    name, port = host.split(":")
    with socket.create_connection((name, int(port))) as pipe:
        pipe.sendall(request_.replace(b"{}", host.encode()))
        if request_.endswith(b"\n"):
            assert b" 400 " in pipe.recv(100)
        pipe.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # resets it
    assert asked(f"http://{host}/state")[0] == 200
    assert "Traceback" not in capsys.readouterr().err


def test_the_state_changes_when_a_file_does(tmp_path, serving):
    file = bvh_file(tmp_path / "walk.bvh", 6)
    url = serving(CaseList(files=[file]))
    before = asked(f"{url}/state")
    assert asked(f"{url}/state") == before
    frames = json.loads(asked(f"{url}/scene?case=")[1])["frames"]
    bvh_file(file, frames + 3)
    assert asked(f"{url}/state") != before
    assert json.loads(asked(f"{url}/scene?case=")[1])["frames"] == frames + 3


def test_self_penetration_is_computed_for_the_frame_that_is_asked_for(tmp_path, serving, monkeypatch):
    person = fleshed()
    moved = hand_to_belly(person, 7)
    figures = (figure_of("deep", "motion", moved),)
    inside = int(figures[0].inside_at(3).sum())
    monkeypatch.setattr(CaseList, "scene", lambda self, case: Scene("tubes", figures, 30.0))
    looked = []
    plain = scenes.inside_mask
    monkeypatch.setattr(scenes, "inside_mask", lambda *each: looked.append(1) or plain(*each))
    url = serving(CaseList(files=[bvh_file(tmp_path / "walk.bvh", 6)]))
    assert json.loads(asked(f"{url}/scene?case=")[1])["figures"][0]["skin"]
    assert looked == []
    corners = json.loads(asked(f"{url}/inside?case=&figure=0&frame=3")[1])
    assert len(corners) == inside > 0
    assert looked == [1]


def bench_view(*arguments: str) -> subprocess.Popen:
    toy = str(HERE / "viewing_toys" / "toy_moves.py")
    command = [sys.executable, "-m", "retarget_bench", "view", *arguments, "--no-open", "-d", toy]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_the_page_is_there_on_this_machine_alone_until_ctrl_c(tmp_path):
    process = bench_view(str(bvh_file(tmp_path / "walk.bvh", 6)), "--port", "0")
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        url = re.fullmatch(r"(http://127\.0\.0\.1:\d+) shows it; Ctrl-C stops\n", line)[1]
        status, page = asked(url)
        assert status == 200
        assert b"RetargetPlayer" in page
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=30)
    finally:
        process.kill()
    assert (process.returncode, out) == (0, "stopped\n")
    assert "Traceback" not in err


def test_pages_of_other_sites_are_refused(tmp_path, serving):
    url = serving(CaseList(files=[bvh_file(tmp_path / "walk.bvh", 6)]))
    port = url.rpartition(":")[2]
    here, localhost = f"127.0.0.1:{port}", f"localhost:{port}"

    def answered(**headers: str) -> int:
        return asked(f"{url}/cases", **headers)[0]

    assert answered() == answered(Host=localhost, Origin=f"http://{localhost}") == 200
    assert answered(Origin=f"http://{here}", **{"Sec-Fetch-Site": "same-origin"}) == 200
    for origin in ("http://evil.example", f"http://evil.example:{port}", "null", "", f"http://{localhost}"):
        assert answered(Origin=origin) == 403, origin
    for other in (f"evil.example:{port}", "evil.example", f"127.0.0.1:{int(port) + 1}"):
        assert answered(Host=other) == 403, other
    for site in ("cross-site", "same-site"):
        assert answered(**{"Sec-Fetch-Site": site}) == 403, site


def test_it_plays_in_a_browser_and_follows_its_file(tmp_path, serving, browser):
    file = bvh_file(tmp_path / "walk.bvh", 6)
    tab = browser.new_page()
    try:
        tab.goto(serving(CaseList(files=[file])))
        tab.get_by_text("/ 6").wait_for()
        assert not tab.locator("#case").is_visible()
        tab.get_by_role("button", name="Pause").click()
        tab.get_by_role("button", name="Overlay").click()
        bvh_file(file, 9)
        tab.get_by_text("/ 9").wait_for(timeout=60_000)
        assert tab.get_by_role("button", name="Play", exact=True).is_visible(), "as it was looked at before"
        assert tab.get_by_role("button", name="Overlay").get_attribute("aria-pressed") == "true"
    finally:
        tab.close()


def refused(capsys, *arguments: str) -> str:
    with pytest.raises(SystemExit) as left:
        cli.main(["view", *arguments, "--no-open"])
    assert left.value.code == 2
    return capsys.readouterr().err


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
