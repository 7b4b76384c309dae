"""Several data sets as one to train on."""

import json
import pickle
import re
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.errors import BenchError, Unusable
from retarget_bench.plugins import bound, registry
from retarget_bench.plugins.spec import Spec
from retarget_bench.training import clips, joint_datasets
from retarget_bench.training.card import manifest
from retarget_bench.training.config import Augmentation
from retarget_bench.training.gather import clips_of, gather
from retarget_bench.training.joint_datasets import JointDataset, canonical, joint_spec
from tests.in_process import carried_out_here

ONE, TWO = Spec("toy_walks"), Spec("toy_walks", {"content": "two"})
BOTH = joint_spec([ONE, TWO])


@pytest.fixture
def both(toy_plugins):
    return joint_datasets.dataset(BOTH)


@pytest.fixture
def gathered(toy_plugins, monkeypatch):
    monkeypatch.setattr(clips, "carried_out", carried_out_here)

    def gather_(data, method="toy_trainee"):
        return gather(Spec.parse(data), Spec.parse(method), 30.0, 1, lambda done, total: None)

    return gather_


def card(folder):
    return json.loads((folder / "weights.json").read_text())


# -------------------------------------------------------------------------------------------- as specs
def test_one_spec_names_them_all_in_their_order(toy_plugins):
    assert str(BOTH) == "toy_walks+toy_walks[content=two]"
    assert Spec.parse(str(BOTH)) == canonical(BOTH) == BOTH
    assert str(joint_spec([BOTH, Spec("puppets")])) == f"{BOTH}+puppets"
    typed = joint_spec([Spec.parse("puppets[size=tiny]"), Spec.parse("toy_walks[content=one]")])
    assert str(canonical(typed)) == "puppets+toy_walks"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("puppets+toy_walks+puppets[seed=0]", "^puppets is given twice"),
        (
            "toy_walks[root=/a/b]+toy_walks[content=two,root=/a/./b]",
            "are of the same files; one could train on what the other tests",
        ),
        ("puppets+walks", "no data set is called 'walks'"),
    ],
)
def test_what_cannot_be_together(toy_plugins, text, says):
    with pytest.raises(BenchError, match=says):
        canonical(Spec.parse(text))


def test_the_same_plug_in_over_two_folders_is_two_data_sets(toy_plugins):
    assert (
        len(joint_datasets.split_spec(canonical(Spec.parse("toy_walks[root=/a]+toy_walks[root=/b]")))) == 2
    )


def test_without_places_is_without_the_place_of_each():
    spec = Spec.parse("folder[protocol=train,root=/a/b]+puppets+folder[root=/c]")
    assert str(joint_datasets.without_places(spec)) == "folder[protocol=train]+puppets+folder"


# ---------------------------------------------------------------------------------------- as a data set
def test_characters_of_one_name_stay_two_and_structures_of_one_name_are_one(both):
    assert {name: list(bodies) for name, bodies in both.training().items()} == {
        "toy": ["small", "tall", "small-2", "tall-2"]
    }
    cast = both.characters()
    assert set(cast) == {"small", "tall", "held", "small-2", "tall-2", "held-2"}
    assert all(body.name == name for name, body in cast.items())
    assert cast["tall-2"].height == cast["tall"].height != cast["small-2"].height


names = st.lists(st.sampled_from(("a", "b", "a-2", "a-3", "b-2", "a-2-2")), unique=True, min_size=1)


@given(st.lists(names, min_size=1, max_size=4))
def test_no_two_characters_get_one_name(name_lists):
    card = bound.dataset(Spec("puppets")).built.card
    joint = JointDataset(
        [SimpleNamespace(card=card, characters=lambda own=own: dict.fromkeys(own)) for own in name_lists]
    )
    here = [
        member.names[name] for member, own in zip(joint.members, name_lists, strict=True) for name in own
    ]
    assert len(set(here)) == len(here)
    assert all(member.names[name].startswith(name) for member in joint.members for name in member.names)
    assert all(name == other for name, other in joint.members[0].names.items())


def test_its_cases_are_those_of_all_under_ids_of_their_own(both):
    aside, own = both.validation(), bound.dataset(ONE).built
    for split in ("intra", "cross"):
        cases, expected = aside.cases("retarget", split), own.cases("retarget", split)
        assert len({info.id for info in cases}) == len(cases) == 2 * len(expected)
        assert [info.id for info in cases[: len(expected)]] == [info.id for info in expected]
        for info, other in zip(cases[len(expected) :], expected, strict=True):
            assert (info.source, info.target) == (f"{other.source}-2", f"{other.target}-2")
            case = aside.load(info)
            assert case.info is info
            assert (case.source.root == own.load(other).source.root).all()
    assert aside.cases("denoise", "intra") == ()
    with pytest.raises(BenchError, match="has no case"):
        aside.load(SimpleNamespace(id="toys/nobody>tall/clip 0"))


def test_the_validation_part_is_of_those_that_have_one(toy_plugins):
    unwatched = Spec("toy_walks", {"kind": "unwatched"})
    some = joint_datasets.dataset(joint_spec([unwatched, TWO]))
    assert len(some.validation().cases("retarget", "intra")) == 8
    assert list(some.training_notes) == [
        "no part of toy_walks validates: other data chose the weights",
    ]
    none = joint_datasets.dataset(
        joint_spec([unwatched, Spec("toy_walks", {"kind": "unwatched", "content": "b"})])
    )
    assert none.validation() is None
    assert not none.training_notes


def test_the_first_with_cases_is_the_one_to_test_on(toy_plugins, monkeypatch):
    assert joint_datasets.tested(BOTH) == ONE
    monkeypatch.setattr(
        type(bound.dataset(ONE).built), "cases", lambda self, *_: [0] * (self.content == "two")
    )
    assert joint_datasets.tested(BOTH) == TWO
    assert joint_datasets.tested(ONE) is None


# -------------------------------------------------------------------------------------------- to train


def test_a_worker_knows_no_more_than_the_spec(gathered, tmp_path):
    """It builds the data sets anew and gives a character's clips by the name that it has among all."""
    here = gathered(BOTH).clips["tall-2"]
    job = {"character": "tall-2", "dataset": BOTH, "method": Spec("toy_trainee"), "fps": 30.0}
    others = {"plugins": registry.files(), "folder": tmp_path, "augmentation": Augmentation(slant=0.0)}
    sent = pickle.loads(pickle.dumps({**job, **others}))
    joint_datasets._several.cache_clear()
    bound._dataset.cache_clear()
    stored, others, unusable = clips_of(sent)
    assert (others, unusable) == (0, [])
    assert [each[:3] for each in stored.clips] == [("tall-2", clip.name, clip.frames) for clip in here]
    assert {clip.character for clip in here} == {"tall-2"}
    for clip, read in zip(here, stored.read(), strict=True):
        assert clip.arrays.keys() == read.arrays.keys()
        assert all(np.array_equal(read.arrays[key], clip.arrays[key]) for key in clip.arrays)
        np.testing.assert_array_equal(read.motion["root"], clip.arrays["root"])
        assert read.motion["rotations"].shape == (clip.frames, 9, 4)


def test_augmentation_adds_a_reshaped_body_to_each_that_does_the_same_clips(gathered):
    plain = gathered(ONE)
    data = gather(ONE, Spec("toy_trainee"), 30.0, 1, lambda *_: None, Augmentation())
    assert set(data.clips) == set(plain.clips) | {f"{name} reshaped" for name in plain.clips}
    assert data.characters.keys() == data.clips.keys()
    for name, before in plain.clips.items():
        own, others = data.clips[name], data.clips[f"{name} reshaped"]
        assert (
            [each.name for each in others] == [each.name for each in own] == [each.name for each in before]
        )
        for one, again in zip(before, own, strict=True):
            assert all(np.array_equal(one.arrays[key], again.arrays[key]) for key in one.arrays)
        assert data.characters[f"{name} reshaped"].structure == data.characters[name].structure


def lose(monkeypatch, *clips):
    """These clips of the toys cannot be used."""
    kind = type(bound.dataset(ONE).built.training()["toy"]["tall"])
    usual = kind.__getitem__

    def broken(self, number):
        if self.names[number] in clips:
            raise Unusable(self.names[number], "it was lost")
        return usual(self, number)

    monkeypatch.setattr(kind, "__getitem__", broken)


def test_clips_that_cannot_be_used_are_left_out_with_the_reason(gathered, monkeypatch):
    lose(monkeypatch, "walk-tall-1")
    data = gathered(ONE)
    assert [clip.name for clip in data.clips["tall"]] == ["walk-tall-0", "walk-tall-2"]
    assert list(data.notes) == ["not trained on 1 clip of tall: walk-tall-1 (it was lost)"]
    declared = {"characters": ["tall", "small"], "clips": ["walk-tall-0", "walk-tall-1", "aside"]}
    monkeypatch.setattr(bound.dataset(ONE).built, "training_manifest", lambda: declared, raising=False)
    assert manifest(bound.dataset(ONE).built, data) == {
        "characters": ["tall", "small"],
        "clips": ["walk-tall-0", "aside"],
    }


def test_a_body_of_which_no_clip_can_be_used_is_left_out(gathered, monkeypatch):
    """Bodies that no case shows are known by their first clip that can be used."""
    lose(monkeypatch, "walk-tall-0", "walk-small-0", "walk-small-1", "walk-small-2")
    monkeypatch.setattr(type(bound.dataset(ONE).built), "characters", lambda _: {})
    data = gathered(ONE)
    assert [clip.name for clip in data.clips["tall"]] == ["walk-tall-1", "walk-tall-2"]
    assert "small" not in data.clips
    assert "not trained on small: none of its clips can be used" in data.notes


def test_the_manifest_keeps_the_names_that_the_data_sets_give(gathered, both, monkeypatch):
    declared = {"characters": ["small", "tall", "held"], "structures": ["toy"], "kinds": ["walk"]}
    monkeypatch.setattr(bound.dataset(ONE).built, "training_manifest", lambda: declared, raising=False)
    assert manifest(both, gathered(BOTH)) == {
        "characters": ["small", "tall", "held"],
        "structures": ["toy"],
        "kinds": ["walk"],
    }
    # of the second data set, the method takes nobody, since its own name is not tall there
    assert manifest(both, gathered(BOTH, "toy_trainee[does=pick]"))["characters"] == ["tall", "held"]


def test_a_run_on_both_goes_on_to_the_last_bit_and_its_card_names_both(toy_run, tmp_path):
    data = "toy_walks[root=/secret]+toy_walks[content=two]"
    complete, reporter = toy_run("whole", data=data, preset="quick")
    assert reporter.said[-1] == "training on 0 minutes of motion: 12 clips of 4 characters"
    toy_run("parts", data=data, preset="quick", stop=7)
    moved = "toy_walks[root=/elsewhere]+toy_walks[content=two]"
    trained, _ = toy_run("parts", data=moved, preset="quick", resume=True)
    facts, again = card(tmp_path / "whole"), card(tmp_path / "parts")
    assert facts["hash"] == again["hash"]
    assert trained.dataset == moved
    assert facts["command"] == (
        "bench train toy_trainee.py -d toy_walks.py -d 'toy_walks.py[content=two]' --preset quick --seed 0"
    )
    assert "secret" not in json.dumps(facts)
    expected = {"spec": "toy_walks+toy_walks[content=two]", "label": "toy_walks + toy_walks"}
    assert expected.items() <= facts["data"].items()
    assert (facts["data"]["content"], facts["data"]["clips"]) == ("one + two", 12)
    assert {split: each["n"] for split, each in complete.best.scores.items()} == {"intra": 2, "cross": 2}
    with pytest.raises(BenchError, match=re.escape(f"began with dataset {moved}, not toy_walks")):
        toy_run("parts", data="toy_walks", resume=True)
