"""The puppets' cache and files: kept whole, rebuilt when damaged, exported with check sums."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from retarget_bench.datasets.puppets import plugin as Puppets
from retarget_bench.errors import BenchError
from retarget_bench.exchange import dataset_export
from retarget_bench.motion import bvh, importer
from retarget_bench.motion.files.reading import Reading


def generated() -> Puppets:
    """A corpus that is solved on demand and kept in the cache, as tiny is not."""
    return Puppets(size="default")


def cached(cache: Path) -> list[Path]:
    return sorted(cache.rglob("*.npz"))


def test_solved_clips_are_kept_and_read_back(cache: Path) -> None:
    info = generated().cases("retarget", "cross")[0]
    first = generated().load(info).reference
    files = cached(cache)
    assert len(files) == 3  # source, reference, second answer
    stamps = [file.stat().st_mtime_ns for file in files]
    second = generated().load(info).reference
    assert [file.stat().st_mtime_ns for file in files] == stamps
    assert np.array_equal(first.rotations, second.rotations)
    assert np.array_equal(first.root, second.root)


@pytest.mark.parametrize("damage", ["cut", "flip", "empty", "other", "exchanged"])
def test_a_damaged_cache_is_noticed_and_rebuilt(cache: Path, damage: str) -> None:
    info = generated().cases("retarget", "cross")[0]
    good = generated().load(info).reference
    (file,) = [path for path in cached(cache) if path.name == f"{info.target}-usual.npz"]
    content = file.read_bytes()
    if damage == "flip":
        place = len(content) // 2
        file.write_bytes(content[:place] + bytes([content[place] ^ 0xFF]) + content[place + 1 :])
    elif damage == "other":
        np.savez(file, something=np.zeros(3))
    elif damage == "exchanged":
        file.write_bytes(next(path for path in cached(cache) if path != file).read_bytes())
    else:
        file.write_bytes(content[: len(content) // 3] if damage == "cut" else b"")
    assert np.array_equal(generated().load(info).reference.rotations, good.rotations)
    assert np.array_equal(generated().load(info).reference.root, good.root)
    assert file.read_bytes() == content


def test_a_cache_that_cannot_be_written_costs_nothing_but_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("RETARGET_BENCH_CACHE", str(tmp_path / "file"))
    data = generated()
    assert data.load(data.cases("retarget", "self")[0]).reference.frames > 0


def _load_some(start: int) -> float:
    data = generated()
    infos = data.cases("retarget", "cross")[:4]
    return float(sum(data.load(infos[(start + k) % 4]).reference.rotations.sum() for k in range(4)))


def test_several_processes_build_at_once(cache: Path) -> None:
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        totals = pool.map(_load_some, [0, 2])
    np.testing.assert_allclose(totals, totals[0])
    infos = generated().cases("retarget", "cross")[:4]
    performed = {(i.clip, name, "usual") for i in infos for name in (i.source, i.target)}
    performed |= {(i.clip, i.target, "second") for i in infos}
    assert len(cached(cache)) == len(performed)
    assert not [path for path in cache.rglob(".*") if path.is_file()]


@pytest.mark.parametrize("size", ["tiny", "default"])
def test_building_the_data_set_reads_and_makes_nothing(cache: Path, size: str) -> None:
    code = (
        "from retarget_bench.datasets.puppets import plugin; import sys;"
        f"d = plugin({size!r}); d.cases('retarget', 'intra'); d.notes;"
        "assert not {'torch', 'scipy', 'pandas', 'matplotlib'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env={**os.environ, "PYTHONPATH": "."})
    assert cached(cache) == []


class Few(Puppets):
    """The corpus with a few cases and training clips."""

    def cases(self, task, split):
        return super().cases(task, split)[:2]

    def parts(self):
        return {"test": self, "validation": Few(part="validation")}

    def training(self):
        return {"body22": {name: own[:2] for name, own in list(super().training()["body22"].items())[:2]}}


class FewBodies(Few):
    """A corpus that lists two of its bodies: the mesh of each takes a while to make."""

    def characters(self):
        return dict(list(super().characters().items())[:2])


def exported(folder: Path, stop: int = 10**6, form: str = "bvh") -> None:
    data = Few() if form == "bvh" else FewBodies()
    for count, total in dataset_export.export(data, "puppets", folder, form):
        assert 0 < count <= total == 16
        if count == stop:
            return


def contents(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_an_export_holds_what_the_corpus_holds(tmp_path: Path) -> None:
    exported(tmp_path / "out")
    files = contents(tmp_path / "out")
    manifest = json.loads(files["manifest.json"])
    assert {row["part"] for row in manifest["cases"]} == {"test", "validation"}
    assert len(manifest["cases"]) == 12
    data = Few()
    for row, info in zip(
        manifest["cases"],
        [i for s in ("self", "intra", "cross") for i in data.cases("retarget", s)],
        strict=False,
    ):
        case = data.load(info)
        for key in ("source", "reference", "alternative"):
            back = bvh.read(tmp_path / "out" / row[f"{key}_file"], scale=0.01)
            motion = getattr(case, key)
            again = motion.character.motion(back.rotations, back.root, back.fps)
            np.testing.assert_allclose(again.positions, motion.positions, rtol=0, atol=1e-6)
        labels = json.loads(files[row["labels_file"]])
        for column, role in enumerate(case.contacts.roles):
            planted = np.zeros(info.frames, dtype=bool)
            for first, end in labels["planted"][role]:
                planted[first:end] = True
            assert np.array_equal(planted, case.contacts.planted[:, column])
        assert labels["kind"][0][1] == 0
        assert labels["kind"][-1][2] == info.frames == len(labels["phase"])
    assert len(manifest["training"]) == 4
    assert {row["file"] for row in manifest["training"]} <= set(files)
    sums = dict(line.split("  ")[::-1] for line in files["SHA256SUMS"].decode().splitlines())
    assert set(sums) == set(files) - {"SHA256SUMS"}
    assert all(hashlib.sha256(files[name]).hexdigest() == total for name, total in sums.items())


def test_an_export_as_glb_has_the_motions_and_the_skins(tmp_path: Path) -> None:
    exported(tmp_path / "out", form="glb")
    files = contents(tmp_path / "out")
    assert {Path(name).suffix for name in files if "/" in name} == {".glb", ".json"}
    manifest = json.loads(files["manifest.json"])
    assert manifest["conventions"].startswith("GLB (glTF 2.0) in metres")
    data = FewBodies()
    row, info = manifest["cases"][0], data.cases("retarget", "self")[0]
    motion = data.load(info).reference
    back = importer.load(tmp_path / "out" / row["reference_file"], Reading(unit="m")).motion
    assert back.skeleton.names == motion.skeleton.names
    assert np.abs(back.positions - motion.positions).max() < 1e-5
    mesh = motion.character.mesh
    assert mesh is not None
    assert np.abs(back.character.mesh.skinned(back) - mesh.skinned(motion)).max() < 1e-3
    with pytest.raises(BenchError, match="another export"):
        exported(tmp_path / "out")


def test_an_interrupted_export_goes_on_and_a_damaged_one_is_repaired(tmp_path: Path) -> None:
    exported(tmp_path / "whole")
    exported(tmp_path / "again", stop=5)
    begun = {p: p.stat().st_mtime_ns for p in (tmp_path / "again").rglob("*.bvh")}
    assert set(json.loads((tmp_path / "again" / "manifest.json").read_text())) == {"export"}
    assert not (tmp_path / "again" / dataset_export.SUMS).exists()
    exported(tmp_path / "again", stop=9)
    exported(tmp_path / "again")
    assert contents(tmp_path / "again") == contents(tmp_path / "whole")
    assert all(path.stat().st_mtime_ns == stamp for path, stamp in begun.items())
    victim = next(iter(begun))
    victim.write_bytes(victim.read_bytes()[:100])
    exported(tmp_path / "again")
    assert contents(tmp_path / "again") == contents(tmp_path / "whole")


def test_an_export_touches_no_other_folder(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear")
    with pytest.raises(BenchError, match="not empty"):
        exported(tmp_path / "mine")
    assert contents(tmp_path / "mine") == {"letter.txt": b"dear"}
    exported(tmp_path / "one")
    with pytest.raises(BenchError, match="another export"):
        next(dataset_export.export(Few(seed=3), "puppets[seed=3]", tmp_path / "one"))
    (tmp_path / "one" / "manifest.json").write_text("{}")
    with pytest.raises(BenchError, match="not the manifest"):
        exported(tmp_path / "one")
    with pytest.raises(BenchError, match="is a file"):
        exported(tmp_path / "mine" / "letter.txt")


def test_a_whole_data_set_has_no_splits(tmp_path, bench):
    code, _, err = bench("export", "puppets", tmp_path / "out", "-s", "cross")
    assert code == 2
    assert "only --questions may be of some splits" in err
    assert not (tmp_path / "out").exists()
