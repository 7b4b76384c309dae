"""Weights that the wheel lacks: fetched once, with their hash; the list and the wheel agree."""

from __future__ import annotations

import hashlib
import shutil
import tomllib
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest

import retarget_bench as rb
from retarget_bench import __version__, distribution
from retarget_bench.errors import FileError
from retarget_bench.training import released, weights

ROOT = Path(__file__).parents[2]
SAME = ROOT / "methods" / "same" / "weights"


@pytest.fixture
def release(tmp_path, monkeypatch):
    """A release with one file of weights, by HTTP, whose requests are counted."""
    folder = tmp_path / "served" / "releases" / "download" / f"v{__version__}"
    folder.mkdir(parents=True)
    shutil.copy(SAME / "puppets.safetensors", folder / "same-puppets.safetensors")

    class Handler(SimpleHTTPRequestHandler):
        asked: list[str] = []  # noqa: RUF012

        def log_message(self, *_):
            self.asked.append(self.path)

    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=tmp_path / "served"))
    Thread(target=server.serve_forever, daemon=True).start()
    monkeypatch.setattr(distribution, "address", lambda: f"http://127.0.0.1:{server.server_port}")
    monkeypatch.setenv("RETARGET_BENCH_CACHE", str(tmp_path / "cache"))
    yield folder, Handler.asked
    server.shutdown()
    server.server_close()


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """The card of a method as a wheel has it, beside which there are no tensors."""
    place = tmp_path / "methods" / "same" / "weights"
    place.mkdir(parents=True)
    shutil.copy(SAME / "puppets.json", place)
    shutil.copy(ROOT / "methods" / released.LIST, tmp_path / "methods")
    monkeypatch.setattr(rb.methods, "__path__", [str(tmp_path / "methods")])
    return place / "puppets.json"


def test_weights_are_fetched_once(release, installed):
    _, asked = release
    read = weights.read(installed)
    assert read.hash == weights.read(SAME / "puppets.json").hash
    weights.read(installed)
    assert len(asked) == 1


def test_the_copy_is_for_whoever_shares_the_cache(release, installed, tmp_path):
    weights.read(installed)
    (copy,) = (tmp_path / "cache" / "weights").iterdir()
    assert copy.stat().st_mode & 0o444 == 0o444


def test_a_relative_cache_is_one_folder_wherever_processes_work(release, installed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("RETARGET_BENCH_CACHE", "here")
    weights.read(installed)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    weights.read(installed)
    assert len(release[1]) == 1


@pytest.mark.parametrize("name", ["card.json", "a/b/c/card.json"])
def test_cards_of_others_are_fetched_from_nowhere(installed, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    card = Path(name)
    card.parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / released.LIST).write_text("of something else\n")
    shutil.copy(installed, card)
    with pytest.raises(FileError, match=r"card\.safetensors: cannot be read"):
        weights.read(card)


def test_what_lies_beside_the_card_counts(release, installed):
    shutil.copy(SAME / "puppets.safetensors", installed.parent)
    assert weights.read(installed).tensors
    assert not release[1]


def test_a_copy_that_was_damaged_since_is_fetched_anew(release, installed, tmp_path):
    weights.read(installed)
    (copy,) = (tmp_path / "cache" / "weights").iterdir()
    copy.write_bytes(copy.read_bytes()[:-1])
    assert weights.read(installed).tensors
    assert len(release[1]) == 2


def test_other_bytes_are_refused_and_not_kept(release, installed, tmp_path):
    file = release[0] / "same-puppets.safetensors"
    file.write_bytes(file.read_bytes()[::-1])
    with pytest.raises(FileError, match=r"could not be fetched from http://127.0.0.1.*hash"):
        weights.read(installed)
    assert not [*(tmp_path / "cache" / "weights").iterdir()]


def test_without_a_network_the_message_says_what_to_do(installed, tmp_path, monkeypatch):
    monkeypatch.setattr(distribution, "address", lambda: "http://127.0.0.1:9/none")
    monkeypatch.setenv("RETARGET_BENCH_CACHE", str(tmp_path / "cache"))
    with pytest.raises(
        FileError, match=r"could not be fetched from http://127.0.0.1:9/none/releases"
    ) as told:
        weights.read(installed)
    assert told.value.path == installed.with_suffix(".safetensors")
    assert "RETARGET_BENCH_CACHE" in told.value.problem


def test_the_list_is_of_the_files_that_the_wheel_lacks():
    rows = released.listed(ROOT / "methods" / released.LIST)
    setuptools = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]
    folder = ROOT / "methods"
    lacking = {
        file.relative_to(folder)
        for pattern in setuptools["exclude-package-data"]["retarget_bench.methods"]
        for file in folder.glob(pattern)
    }
    assert {Path(*parts) for parts in rows} == lacking
    for parts, digest in rows.items():
        assert hashlib.sha256(folder.joinpath(*parts).read_bytes()).hexdigest() == digest, parts
