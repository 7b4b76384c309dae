"""Variants of a method in a TOML file: what tables say and leave out, and what does not fit."""

from dataclasses import dataclass, field
from typing import Literal

import pytest

from retarget_bench.errors import FileError
from retarget_bench.training import variants


@dataclass(frozen=True)
class Network:
    kind: Literal["wide", "deep"] = "wide"
    widths: tuple[int, ...] = (8, 8)
    dropout: float = 0.0


@dataclass(frozen=True)
class Settings:
    name: str
    network: Network = field(default_factory=Network)


def read(tmp_path, text: str):
    path = tmp_path / "variants.toml"
    path.write_text(text)
    return variants.read(path, Settings)


def test_a_variant_is_as_another_but_for_what_its_table_says(tmp_path):
    read_variants = read(
        tmp_path,
        """
        [own]
        like = "paper"
        network = { dropout = 0.5 }
        [paper]
        name = "as written"
        network = { kind = "deep", widths = [4] }
        """,
    )
    assert read_variants == {
        "own": Settings("as written", Network("deep", (4,), 0.5)),
        "paper": Settings("as written", Network("deep", (4,))),
    }


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[own]\nname = 'a'\nnetwork = { depth = 3 }", "own.network.depth"),
        ("[own]\nname = 'a'\nnetwork = { kind = 'tall' }", "own.network.kind"),
        ("[own]\n", "own.name"),
        ("[own]\nlike = 'paper'", "own is like 'paper'"),
        ("[own]\nlike = 'own'", "own is like 'own'"),
        ("[own]\nname = 'a'\nnetwork = { dropout = true }", "own.network.dropout"),
        ("[own]\nname = 'a'\nnetwork = { dropout = nan }", "at own"),
        ("[own]\nname = 3", "own.name"),
        ("width = 3", "has width, which is no table"),
        ("[own]\nlike = ['own']", "at own"),
    ],
)
def test_what_does_not_fit_is_named(tmp_path, text, said):
    with pytest.raises(FileError, match=r"variants\.toml") as caught:
        read(tmp_path, text)
    assert said in str(caught.value)
