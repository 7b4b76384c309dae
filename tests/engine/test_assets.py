"""Files outside a method's code: they belong to what a result is known by, wherever it runs."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from retarget_bench import cli
from retarget_bench.evaluation.plan import forget
from retarget_bench.plugins import registry

METHOD = '''"""Rotations scaled by a number in a file."""

import numpy as np

from retarget_bench.api import Asset, MethodCard
from retarget_bench.plugins.assets import asset_path


class Filed:
    card = MethodCard(
        name="filed",
        summary="Stands where a file says",
        version="1",
        assets={ASSETS},
        trained_on={"characters": ("ann",), "structures": ("puppet",)},
    )

    def __init__(self, where: str = "place.npy") -> None:
        self.where = where

    def supports(self, source, target):
        return None

    def retarget(self, source, target, *, context):
        place = np.load(asset_path(self, "NAME"))
        rotations = np.zeros((source.frames, len(target.skeleton), 4))
        rotations[..., 0] = 1
        return target.motion(rotations, np.broadcast_to(place, (source.frames, 3)), source.fps)


plugin = Filed
'''


@pytest.fixture
def bench(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def run(*words: str) -> tuple[int, str]:
        forget()
        with pytest.raises(SystemExit) as ended:
            cli.main([*map(str, words)])
        captured = capsys.readouterr()
        return ended.value.code or 0, captured.out + captured.err

    yield run
    (tmp_path / "filed.py").unlink(missing_ok=True)
    registry.refresh_files()
    forget()


def written(folder: Path, name: str = "place.npy", sha256: str = "") -> Path:
    """The plug-in with an asset of that name."""
    asset = f'{{"{name}": Asset("the place", sha256="{sha256}")}}'
    path = folder / "filed.py"
    path.write_text(METHOD.replace("{ASSETS}", asset).replace("NAME", name))
    return path


def asked(plugin: Path, parameters: str = "") -> tuple[str, ...]:
    data = ("-d", "puppets[size=tiny]", "--splits", "self", "--metrics", "mpjpe", "--out", "out")
    return ("run", f"{plugin}{parameters}", *data)


def headers(folder: Path = Path("out")) -> list[dict]:
    documents = [json.loads(path.read_text()) for path in folder.rglob("*filed*.json")]
    return [each for each in documents if "method" in each]


def test_what_a_file_beside_the_module_holds_is_part_of_the_key(bench, in_process, tmp_path):
    plugin = written(tmp_path)
    np.save(tmp_path / "place.npy", np.array([0.0, 1.0, 0.0]))
    code, text = bench(*asked(plugin))
    assert code == 0, text
    (before,) = headers()
    code, text = bench(*asked(plugin))
    assert code == 0, text
    assert headers() == [before]
    np.save(tmp_path / "place.npy", np.array([0.0, 2.0, 0.0]))
    code, text = bench(*asked(plugin))
    assert code == 0, text
    (after,) = headers()
    assert after["keys"] != before["keys"]
    assert after["method"]["trained_on"] == {"characters": ["ann"], "structures": ["puppet"]}


@pytest.mark.parametrize(
    ("name", "parameters", "cure"),
    [("place.npy", "", "put it there"), ("where", "[where=no/where.npy]", "give where=PATH")],
)
def test_a_missing_file_is_a_sentence_and_no_run(bench, tmp_path, name, parameters, cure):
    code, text = bench(*asked(written(tmp_path, name), parameters))
    assert code == 2
    assert "filed needs the place" in text
    assert "is not there" in text
    assert cure in text
    assert "Traceback" not in text
    assert not Path("out").exists()


def test_a_file_that_must_be_just_this_one(bench, tmp_path):
    np.save(tmp_path / "place.npy", np.array([0.0, 1.0, 0.0]))
    right = hashlib.sha256((tmp_path / "place.npy").read_bytes()).hexdigest()
    code, text = bench("info", written(tmp_path, sha256=right))
    assert code == 0
    assert f"needs the place (place.npy): sha256 {right[:12]}..." in text
    np.save(tmp_path / "place.npy", np.array([0.0, 2.0, 0.0]))
    code, text = bench(*asked(written(tmp_path, sha256=right)))
    assert code == 2
    assert f"needs the place with sha256 {right[:12]}..." in text


def test_a_folder_counts_with_all_its_files(tmp_path):
    from retarget_bench.plugins.assets import asset_hash

    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a").write_text("1")
    before = asset_hash(tmp_path)
    (tmp_path / "in" / "a").rename(tmp_path / "in" / "b")
    renamed = asset_hash(tmp_path)
    (tmp_path / "in" / "b").write_text("12")
    assert len({before, renamed, asset_hash(tmp_path)}) == 3


def test_a_plain_run_leaves_out_a_method_whose_files_are_lost(bench, tmp_path):
    from retarget_bench.python.plans import default_methods

    registry.add_file(written(tmp_path))
    messages: list[str] = []
    forget()
    assert "filed" not in {spec.name for spec in default_methods("retarget", messages.append)}
    assert any("filed needs the place" in each for each in messages)
