"""Where the published code of SAN and PAN keeps its networks and the statistics of its motions.

Networks lie in ``models/STRUCTURE/EPOCH`` of the folder that their ``--save_dir`` names.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from retarget_bench.errors import FileError

MIXAMO = ("topology0", "topology1")
"""Their names of the two structures of Mixamo's characters."""
NETWORKS = ("auto_encoder.pt", "static_encoder.pt")
MEAN_VAR = ("mean_var", "../datasets/Mixamo/mean_var", "../data_preprocess/Mixamo/Mixamo/mean_var")
"""Where statistics of Mixamo's characters are looked for, from the folder that holds ``models``: the first
place is ours, the others are those of SAN's and of PAN's repository."""
STATISTICS = {"human": "humstats.npz", "dog": "dogstats.npz"}
"""PAN's structure -> the statistics of its motions."""
BETWEEN_LEGS = (".", "../data_preprocess/Lafan1_and_dog")
"""Where these are looked for."""

NOTE = (
    "the authors' weights; the statistics that come with them are of tested motion too, and their mean "
    "stands for other characters of a structure"
)
"""A sentence on such weights."""


@dataclass(frozen=True)
class ReleasedFiles:
    """networks: of each structure the auto-encoder and the encoder of bones. statistics: of all motions."""

    networks: tuple[tuple[Path, ...], ...]
    statistics: tuple[Path, ...]

    @property
    def paths(self) -> tuple[Path, ...]:
        return (*(path for pair in self.networks for path in pair), *self.statistics)


def of_mixamo(folder: Path) -> ReleasedFiles | None:
    """The files of SAN, and of PAN with ``parts=six``; None where there are none.

    Raises FileError where some are missing."""
    return _files(folder, MIXAMO, NETWORKS, _of_characters)


def between_legs(folder: Path) -> ReleasedFiles | None:
    """Those of PAN with ``parts=three``."""
    return _files(folder, tuple(STATISTICS), ("ae.pth", "skel_enc.pth"), _of_species)


def _files(
    folder: Path,
    structures: Sequence[str],
    names: Sequence[str],
    statistics: Callable[[Path], tuple[Path, ...]],
) -> ReleasedFiles | None:
    places = [folder / "models" / structure for structure in structures]
    if not any(place.is_dir() for place in places):
        return None
    return ReleasedFiles(tuple(_networks(place, names) for place in places), statistics(folder))


def _networks(structure: Path, names: Sequence[str]) -> tuple[Path, ...]:
    """The files of the last epoch, as the authors' code takes them."""
    epochs = [int(each.name) for each in structure.glob("*") if each.name.isdecimal() and each.is_dir()]
    if not epochs:
        raise FileError(structure, "there is no folder of an epoch (20000) in it")
    files = tuple(structure / str(max(epochs)) / name for name in names)
    for file in files:
        if not file.is_file():
            raise FileError(file.parent, f"lacks {file.name}; the networks are {' and '.join(names)}")
    return files


def _of_characters(folder: Path) -> tuple[Path, ...]:
    for place in MEAN_VAR:
        means = sorted((folder / place).glob("*_mean.npy"))
        deviations = [mean.with_name(mean.name.replace("_mean.npy", "_var.npy")) for mean in means]
        for file in deviations:
            if not file.is_file():
                raise FileError(file.parent, f"lacks {file.name}, which belongs to a mean that is there")
        if means:
            return (*means, *deviations)
    raise FileError(
        folder,
        "lacks the statistics of the characters, NAME_mean.npy and NAME_var.npy; put them into the folder "
        f"{MEAN_VAR[0]} beside models, or leave both where the authors' repository has them",
    )


def _of_species(folder: Path) -> tuple[Path, ...]:
    for place in BETWEEN_LEGS:
        files = tuple(folder / place / name for name in STATISTICS.values())
        if all(file.is_file() for file in files):
            return files
    raise FileError(
        folder,
        f"lacks the statistics of its motions; put {' and '.join(STATISTICS.values())} beside models, or "
        "leave both where the authors' repository has them",
    )
