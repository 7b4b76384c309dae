"""Feature networks: an encoder's weights and statistics, kept with a card, run with NumPy alone.

A network belongs to one structure, or to all bodies on two legs, of which it sees the joints that they have
in common, by their roles. It takes windows of channels (``windows.py``), three convolutions with stride 2
and tanh make ``(frames / 8, features)`` activations of them, and their mean over time, each brought to mean
0 and standard deviation 1 over the training windows, is the window's feature vector.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from retarget_bench.api import TWO_LEGS, Prediction
from retarget_bench.api.comparison import structure_joints
from retarget_bench.errors import FileError
from retarget_bench.files import cache_folder, slug
from retarget_bench.motion.character import Character
from retarget_bench.motion.roles import ESSENTIAL
from retarget_bench.training import tensor_files as files
from retarget_bench.training.features import windows

KERNEL, STRIDE = 15, 2
BATCH = 64
"""Windows that are encoded at a time: bounds the memory."""
LAYERS = 3
TENSORS = (
    *(f"{kind}_{layer}" for layer in range(LAYERS) for kind in ("weight", "bias")),
    *("input_mean", "input_scale", "feature_mean", "feature_scale"),
)


@dataclass(frozen=True)
class Design:
    """layers: channels of the three convolutions; the last are the features. frames: of a window. hop:
    frames from one scored window to the next."""

    layers: tuple[int, int, int] = (64, 128, 256)
    frames: int = windows.FRAMES
    hop: int = windows.HOP

    @property
    def features(self) -> int:
        return self.layers[-1]


OF_STRUCTURE = Design()
OF_TWO_LEGS = Design(layers=(64, 64, 32), frames=16, hop=4)
"""Few features and short windows, so that some forty clips of two to four seconds make a set."""


def design_of(structure: str) -> Design:
    return OF_TWO_LEGS if structure == TWO_LEGS else OF_STRUCTURE


def stranger(character: Character) -> str:
    """Reason why a body is none of those on two legs that have the shared joints; "" where it is one."""
    if character.four_legged:
        return f"{character.name} stands on four legs"
    if missing := [role for role in ESSENTIAL if role not in character.joint_of]:
        return f"no joint of {character.name} is known as {', '.join(missing)}"
    return windows.unseeable(character)


@dataclass(frozen=True, kw_only=True)
class NetworkCard(files.Hashed):
    """Where a network comes from.

    structure, roles, joints: what it sees: numbers and roles of the structure's joints.
    dataset, content, characters, clips: the training motion, of the structure ``trained_on``.
    windows:   that it learned from, beside ``validation_windows``. features: those that vary.
    recipe:    ``FeatureTrainingConfig``. loss: means by step, of training and validation.
    """

    structure: str
    roles: Sequence[str | None]
    joints: Sequence[int] = ()
    dataset: str = ""
    content: str = ""
    trained_on: str = ""
    characters: Sequence[str] = ()
    note: str = ""
    clips: int = 0
    windows: int = 0
    validation_windows: int = 0
    features: int = 0
    recipe: Mapping[str, Any] = field(default_factory=dict)
    loss: Sequence[Mapping[str, float]] = ()
    seconds: float = 0.0
    torch: str = ""


@dataclass(frozen=True, eq=False)
class Network:
    """tensors: of ``TENSORS``; weights ``(out, in, KERNEL)``, scales are 0 for what never varies."""

    tensors: Mapping[str, np.ndarray]
    card: NetworkCard

    @property
    def hash(self) -> str:
        """Sixteen hex digits of the tensors: what rows name the network by."""
        return self.card.hash

    @property
    def design(self) -> Design:
        return design_of(self.card.structure)

    @property
    def of_two_legs(self) -> bool:
        return self.card.structure == TWO_LEGS

    def unfit(self, character: Character) -> str:
        """Reason why a body cannot be seen by this network; "" where it can."""
        if self.of_two_legs:
            return stranger(character)
        roles = [character.roles[joint] for joint in structure_joints(character)]
        if roles != list(self.card.roles):
            return (
                f"{character.name} has other joints than the feature network of structure "
                f"{self.card.structure} was trained on; bench train fid makes one of its own"
            )
        return windows.unseeable(character)

    def features(self, motion: Prediction, floor: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """``(windows, features)`` float32 of a motion, and ``(windows,)`` root speeds in heights/s."""
        design = self.design
        joints: Sequence[int] | None = (
            motion.character.joints([role for role in self.card.roles if role])
            if self.of_two_legs
            else None
        )
        channels = windows.channels(motion, joints, floor)
        cut = windows.windows(channels, design.hop, design.frames)
        return self.encode(cut), windows.speeds(channels, design.hop, design.frames)

    def encode(self, cut: np.ndarray) -> np.ndarray:
        """``(windows, features)`` float32 of windows ``(windows, frames, channels)``."""
        mean, scale = self._tensor["feature_mean"], self._tensor["feature_scale"]
        features = np.zeros((len(cut), len(mean)), np.float32)
        for at in range(0, len(cut), BATCH):
            features[at : at + BATCH] = (self.activations(cut[at : at + BATCH]) - mean) * scale
        return features

    def activations(self, cut: np.ndarray) -> np.ndarray:
        """``(windows, features)`` deepest activations of a batch, mean over time, as they are."""
        scaled = (cut - self._tensor["input_mean"]) * self._tensor["input_scale"]
        signal = scaled.astype(np.float32)
        for layer in range(LAYERS):
            signal = _convolve(signal, self._filters[layer], self._tensor[f"bias_{layer}"])
        return np.asarray(signal.mean(axis=1, dtype=np.float32))

    @cached_property
    def _tensor(self) -> dict[str, np.ndarray]:
        return {name: np.asarray(value, dtype=np.float32) for name, value in self.tensors.items()}

    @cached_property
    def _filters(self) -> list[np.ndarray]:
        """Per layer ``(KERNEL * in, out)``."""
        weights = (self._tensor[f"weight_{layer}"] for layer in range(LAYERS))
        return [np.ascontiguousarray(w.transpose(2, 1, 0).reshape(-1, len(w))) for w in weights]


def _convolve(signal: np.ndarray, filters: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """Convolution with stride and zero padding, and tanh: ``(windows, frames, in)`` to
    ``(windows, frames / STRIDE, out)``."""
    padded = np.pad(signal, ((0, 0), (KERNEL // 2, KERNEL // 2), (0, 0)))
    count, width, inner = padded.shape
    frames = (width - KERNEL) // STRIDE + 1
    step = padded.strides
    # windows overlap in memory: one row of KERNEL * in numbers is contiguous already
    rows = np.lib.stride_tricks.as_strided(
        padded,
        (count, frames, KERNEL * inner),
        (step[0], STRIDE * step[1], step[2]),
        writeable=False,
    )
    return np.tanh(rows.reshape(count * frames, -1) @ filters + bias).reshape(count, frames, -1)


# ------------------------------------------------------------------------------------------------ files
def own_folder() -> Path:
    """The folder of networks that ``bench train fid`` makes, unless told otherwise."""
    return cache_folder() / "features"


@lru_cache(maxsize=256)
def place(folder: Path, structure: str) -> Path:
    """The card of a structure's network in a folder; its weights are beside it."""
    return folder / f"{slug(structure)}.json"


def write(folder: Path, tensors: Mapping[str, np.ndarray], card: NetworkCard) -> Network:
    """Weights, then the card (whose presence says that all is there), each atomically."""
    return Network(dict(tensors), files.write(place(folder, card.structure), card, tensors))


def find(folder: Path, structure: str) -> Network | None:
    """A structure's network in a folder, None where there is none.

    Raises FileError when it is damaged, its files do not belong together, or it is from a newer version.
    """
    card = place(folder, structure)
    try:
        stamp = card.stat().st_mtime_ns
    except FileNotFoundError:
        return None
    return _read(card, stamp)


@lru_cache(maxsize=16)
def _read(place: Path, _stamp: int) -> Network:
    card = files.read_record(place, NetworkCard, "the card of a feature network")
    tensors = files.read_weights(place, card.hash)
    if set(tensors) != set(TENSORS):
        raise FileError(files.arrays_of(place), "holds other tensors than a feature network; train it anew")
    return Network(tensors, card)
