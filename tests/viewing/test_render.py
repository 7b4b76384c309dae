"""``bench render``: files of the right kind and length, which cases are meant, and errors in words."""

from __future__ import annotations

import re
import shutil
import subprocess

import numpy as np
import pytest
from PIL import Image
from small_runs import CASE, OTHER, bvh_file, ran
from viewing_toys.toy_moves import DOG

from retarget_bench.commands.render import chosen
from retarget_bench.errors import BenchError, FileError
from retarget_bench.python import progress
from retarget_bench.results.store import case_file
from retarget_bench.viewer import clips, live, scene_builder
from retarget_bench.viewer.clips import ffmpeg, write_clip

SMALL = ("--size", "160x120")


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    root = tmp_path_factory.mktemp("runs")
    ran(root, "copy", "raise")
    return root


def moving_square(count: int) -> list[Image.Image]:
    """A white square that goes two pixels to the right in every picture."""
    ground = np.zeros((count, 24, 32, 3), np.uint8) + np.uint8([10, 40, 90])
    for k in range(count):
        ground[k, 8:16, 2 * k : 2 * k + 8] = 255
    return [Image.fromarray(each) for each in ground]


@pytest.mark.parametrize("kind", ["gif", "webp"])
@pytest.mark.parametrize(("count", "fps"), [(1, 30.0), (7, 30.0), (12, 24.0)])
def test_clips_have_every_picture_and_last_as_long_as_the_motion(tmp_path, kind, count, fps):
    path = tmp_path / f"clip.{kind}"
    write_clip(path, moving_square(count), fps)
    lasts = 0
    with Image.open(path) as clip:
        assert clip.n_frames == count
        for number in range(count):
            clip.seek(number)
            clip.load()
            lasts += clip.info.get("duration", 0)
            shown = np.asarray(clip.convert("L")).astype(int)
            assert shown[12, 2 * number + 3] > 230
            assert shown[12, (2 * number + 16) % 32] < 90
    if count > 1:
        assert lasts == pytest.approx(1000 * count / fps, abs=10)


def has_ffmpeg() -> bool:
    try:
        return bool(ffmpeg())
    except BenchError:
        return False


@pytest.mark.skipif(not has_ffmpeg(), reason="no ffmpeg: pip install 'retarget-bench[video]'")
@pytest.mark.parametrize(("count", "size"), [(1, (32, 24)), (9, (33, 25))])
def test_videos_have_every_picture_and_even_sides(tmp_path, count, size):
    path = tmp_path / "clip.mp4"
    write_clip(path, [picture.resize(size) for picture in moving_square(count)], 15.0)
    output = subprocess.run(
        [ffmpeg(), "-hide_banner", "-i", str(path), "-f", "null", "-"],
        capture_output=True,
        text=True,
        check=True,
    ).stderr
    assert re.findall(r"frame= *(\d+)", output)[-1] == str(count)
    assert "h264" in output
    assert f"{size[0] + size[0] % 2}x{size[1] + size[1] % 2}" in output
    assert "15 fps" in output


@pytest.mark.skipif(not has_ffmpeg(), reason="no ffmpeg: pip install 'retarget-bench[video]'")
def test_a_video_that_cannot_be_written_leaves_nothing(tmp_path, monkeypatch):
    def torn():
        yield moving_square(1)[0]
        raise RuntimeError("drawing failed")

    with pytest.raises(RuntimeError, match="drawing failed"):
        write_clip(tmp_path / "torn.mp4", torn(), 30.0)
    false = shutil.which("false")
    monkeypatch.setattr(clips, "ffmpeg", lambda: false)
    with pytest.raises(FileError, match=r"no\.mp4: ffmpeg could not write it \(it does not say why\)"):
        write_clip(tmp_path / "no.mp4", moving_square(3), 30.0)
    assert not list(tmp_path.iterdir())


def test_without_ffmpeg_a_sentence_says_what_to_do(tmp_path, monkeypatch, bench):
    monkeypatch.setattr(clips, "find_spec", lambda name: None)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    status, _, err = bench("render", "whatever", "-o", tmp_path / "clip.mp4")
    assert status == 2
    assert "pip install 'retarget-bench[video]'" in err
    assert len(err.splitlines()) == 1


def test_clips_that_do_not_fit_in_memory_are_refused(tmp_path):
    clips.check_length(tmp_path / "a.mp4", (1920, 1080), 100_000)
    clips.check_length(tmp_path / "a.gif", (1000, 1000), 2000)
    with pytest.raises(
        BenchError, match=r"2001 pictures of 1000 x 1000 pixels need 2\.0 GB .* write \.mp4"
    ):
        clips.check_length(tmp_path / "a.gif", (1000, 1000), 2001)
    with pytest.raises(BenchError, match=r"as \.webp"):
        clips.check_length(tmp_path / "a.webp", (1000, 1000), 667)


def test_frames_are_chosen_in_seconds_and_at_a_rate(tmp_path):
    shown = scene_builder.of_files([bvh_file(tmp_path / "a.bvh", 121, fps=60)])
    assert shown.fps == pytest.approx(60, rel=1e-3)
    assert chosen(shown, 0, None, None) == list(range(0, 121, 2))  # 60 per second is seen at 30
    assert chosen(shown, 1.0, 1.5, 10) == [60, 66, 72, 78, 84, 90]
    assert chosen(shown, 2.0, None, None) == [120]
    with pytest.raises(BenchError, match=r"lasts 2\.00 s; there is nothing from 3 s to the end"):
        chosen(shown, 3.0, None, None)
    with pytest.raises(BenchError, match=r"nothing from 1 s to 0\.5 s"):
        chosen(shown, 1.0, 0.5, None)


def test_a_case_becomes_a_clip_and_what_failed_is_told(runs, tmp_path, bench):
    path = tmp_path / "clip.gif"
    status, out, err = bench("render", "small>tall", "-r", runs, "-o", path, *SMALL, "--fps", "10")
    assert status == 0
    assert err.startswith("toy_method[does=raise]: failed: RuntimeError: out of ideas (toy_method.py:")
    assert "4 pictures of 160 x 120 pixels, 10 per second" in out
    with Image.open(path) as clip:
        assert (clip.n_frames, clip.size) == (4, (160, 120))


def test_what_takes_seconds_says_how_far_it_is(runs, tmp_path, bench, monkeypatch):
    monkeypatch.setattr(progress, "QUICK", -1.0)
    monkeypatch.setattr(live.Window, "serve_forever", lambda window: None)
    clip, page = tmp_path / "clip.gif", tmp_path / "page.html"
    lines = {}
    for words in (
        ["render", "small>tall", "-o", clip, *SMALL, "--fps", "10"],
        ["report", "-o", page, "--clips", "1"],
        ["view", "--no-open", "--port", "0"],
    ):
        status, out, err = bench(*words, "-r", runs)
        assert (status, "steps" in out) == (0, False)
        lines[words[0]] = [line for line in err.splitlines() if "steps" in line]
    assert lines["render"] == ["bench render: 4 of 4 steps in 0.0 min"], "one for each picture"
    assert re.fullmatch(r"bench report: (\d+) of \1 steps in 0\.0 min", *lines["report"])
    assert re.fullmatch(r"bench view: (\d+) of \1 steps in 0\.0 min", *lines["view"])


@pytest.mark.parametrize("name", [CASE, case_file(CASE), "small>tall"])
def test_a_case_goes_by_its_id_its_file_or_a_part_of_it(runs, tmp_path, bench, name):
    path = tmp_path / "still.png"
    status, out, _ = bench(
        "render", name, "-r", runs, "-m", "toy_method", "-o", path, *SMALL, "--frame", "3"
    )
    assert status == 0
    assert "frame 3, 160 x 120 pixels" in out
    assert Image.open(path).size == (160, 120)


def test_stored_predictions_are_shown_with_their_case(runs, tmp_path, bench):
    path = next(runs.glob(f"*/*/*/toy_method/{case_file(OTHER)}.npz"))
    for number, arguments in enumerate(([path], [OTHER, "-r", runs, "-m", "toy_method"])):
        assert bench("render", *arguments, "-o", tmp_path / f"{number}.png", *SMALL)[0] == 0
    assert (tmp_path / "0.png").read_bytes() == (tmp_path / "1.png").read_bytes()


def test_methods_are_asked_now(runs, tmp_path, bench):
    common = ("tall>small", "-o", tmp_path / "now.png", *SMALL, "--hide", "source")
    status, _, err = bench("render", *common, "--ask", "-d", "toy_moves", "-m", "toy_method[does=raise]")
    assert (status, err.count("out of ideas")) == (0, 1)
    assert "say which methods to ask" in bench("render", *common, "--ask")[2]


def test_files_and_sheets(tmp_path, bench):
    dog, person = bvh_file(tmp_path / "dog.bvh", 9, joints=DOG), bvh_file(tmp_path / "<b>.bvh", 5)
    status, out, err = bench("render", dog, person, "--sheet", "-o", tmp_path / "s.png")
    assert (status, err) == (0, "dog: the first 5 of 9 frames\n")
    assert "5 moments" in out
    assert bench("render", dog, "--overlay", "-o", tmp_path / "d.webp", *SMALL)[0] == 0
    assert {path.name for path in tmp_path.iterdir()} == {"dog.bvh", "<b>.bvh", "s.png", "d.webp"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nod", "-o", "x.png"), "'nod' may be 2 cases, such as"),
        (("waltz", "-o", "x.png"), "no case is called 'waltz'; near it: 'toy_moves/"),
        ((CASE, "-o", "x.avi"), "clips are .mp4, .gif, .webp and stills .png"),
        ((CASE, "-o", "x.gif", "--sheet"), "a sheet is a still; end the name in .png"),
        ((CASE, "-o", "x.png", "--frame", "13"), "has no frame 13; its last is 12"),
        ((CASE, "-o", "x.png", "--size", "big"), "a size is WIDTHxHEIGHT"),
        ((CASE, "-o", "x.png", "--size", "3x3"), "cannot be drawn"),
        ((CASE, "-o", "x.png", "-m", "toy_methode"), "did you mean toy_method"),
        ((CASE, "-o", "x.png", "-d", "mixamo"), "no results of mixamo in"),
        ((CASE, OTHER, "-o", "x.png"), "one case is shown at a time"),
        ((CASE, "a.bvh", "-o", "x.png"), "is no motion file, and a.bvh is"),
        (("a.bvh", "-o", "x.png"), "a.bvh: cannot be read"),
    ],
)
def test_what_cannot_be_shown_is_told_in_words(runs, tmp_path, bench, monkeypatch, arguments, words):
    monkeypatch.chdir(tmp_path)
    status, _, err = bench("render", *arguments, "-r", runs)
    assert status == 2
    assert words in err
    assert "Traceback" not in err
    assert not list(tmp_path.iterdir())
