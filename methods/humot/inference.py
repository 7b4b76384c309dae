"""Retargeting by HuMoT: clips of any length in windows as long as those of training, or whole."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from retarget_bench.motion import rates, root_rules
from retarget_bench.motion.character import Character
from retarget_bench.motion.motion import Positions, Prediction
from retarget_bench.training.phases import to_device

from .features import HumotBody, blank, body, headings, rotated, size_factor
from .network import Autoencoder
from .network.tokens import RaggedTokens
from .settings import Windows

WINDOW, HOP = 30, 15
TOKENS = 1 << 16
"""Joints times frames that go through the networks at once."""


@dataclass(frozen=True, eq=False)
class Question:
    """A source at 30 frames per second, Z up, and the target body.

    frames: of the source. positions: ``(frames or more, joints, 3)`` metres: a source shorter than a window
    is held at its last frame, since training has next to no window of a frame or two. actor_size,
    body_size: factors on the actor and the body before they go through the networks. ratios: ``(3,)`` scale
    of the path of the hips.
    """

    source: Prediction
    frames: int
    positions: np.ndarray
    actor: HumotBody
    body: HumotBody
    actor_size: float
    body_size: float
    ratios: np.ndarray

    @classmethod
    def of(cls, source: Prediction, target: Character, rule: str, usual: bool) -> Question:
        """rule: of the path. usual: both go through the networks in the usual size."""
        actor, target_body = body(source.character), body(target)
        places = actor.see(rates.at_thirty(source))
        wait = ((0, max(WINDOW - len(places), 0)), (0, 0), (0, 0))
        actor_size, body_size = (
            size_factor(each.stature) if usual else 1.0 for each in (actor, target_body)
        )
        ratios = root_rules.ratios(rule, source.character, target)[[0, 2, 1]]  # Z up
        positions = np.pad(places, wait, mode="edge")
        return cls(source, len(places), positions, actor, target_body, actor_size, body_size, ratios)


@dataclass(frozen=True, eq=False)
class Piece:
    """Frames of a question. centre: ``(3,)`` where its major joints are on average."""

    question: Question
    start: int
    stop: int
    centre: np.ndarray


def retargeted(
    network: Autoencoder, questions: Sequence[Question], windows: Windows, facing: bool
) -> list[Positions]:
    """Every question's answer. What is beside a question does not change its answer.

    facing: windows go through the networks turned ahead, as in training.
    """
    pieces = [piece for question in questions for piece in _pieces(question, windows)]
    answers: dict[int, list[tuple[Piece, np.ndarray]]] = {}
    for group in _groups(pieces):
        for piece, answer in zip(group, _answered(network, group, facing), strict=True):
            answers.setdefault(id(piece.question), []).append((piece, answer))
    return [_joined(question, answers[id(question)]) for question in questions]


def _pieces(question: Question, windows: Windows) -> Iterator[Piece]:
    """Windows that overlap by half; the last one ends where the clip does."""
    frames = len(question.positions)
    length = frames if windows == "whole" else WINDOW
    starts = sorted({*range(0, frames - length, HOP), frames - length})
    for start in starts:
        yield Piece(question, start, start + length, _centre(question, start, start + length))


def _centre(question: Question, start: int, stop: int) -> np.ndarray:
    """``(3,)`` where the whole body's major joints are on average; those that a part of it lacks are taken
    to be where the template, turned as the part is, has them."""
    actor, places = question.actor, question.positions[start:stop]
    centre = np.asarray(places[:, actor.centring].mean((0, 1)))
    if not actor.beside.any():
        return centre
    joints, frames = np.ones((1, len(actor.joints)), bool), np.ones((1, len(places)), bool)
    angle = headings(places[None], actor.template[None], joints, frames)
    return np.asarray(centre + rotated(actor.beside[None], angle)[0])


def _groups(pieces: Sequence[Piece]) -> Iterator[list[Piece]]:
    """Pieces of about one size, not too many at once."""
    waiting = sorted(pieces, key=lambda piece: (piece.stop - piece.start, len(piece.question.body.joints)))
    while waiting:
        questions = [piece.question for piece in waiting]
        joints = 1 + max(max(len(each.body.joints), len(each.actor.joints)) for each in questions)
        count = max(TOKENS // (joints * (waiting[-1].stop - waiting[-1].start)), 1)
        yield waiting[-count:]
        del waiting[-count:]


def _answered(network: Autoencoder, group: Sequence[Piece], facing: bool) -> Iterator[np.ndarray]:
    """Each ``(frames, joints of the target, 3)`` metres, Z up, about the piece's centre: hips that go as
    far as the source's do, and around them a body as large as the target."""
    lengths = np.array([piece.stop - piece.start for piece in group])
    mask = np.arange(lengths.max()) < lengths[:, None]
    source = blank([len(piece.question.actor.joints) for piece in group], mask.shape[1])
    target = blank([len(piece.question.body.joints) for piece in group], 0)
    for row, piece in enumerate(group):
        question = piece.question
        actor, body = question.actor.template, question.body.template
        places = question.positions[piece.start : piece.stop] - piece.centre
        source["places"][row, : len(places), : len(actor)] = question.actor_size * places
        source["template"][row, : len(actor)] = question.actor_size * actor
        target["template"][row, : len(body)] = question.body_size * body
    angles = np.zeros(len(group))
    if facing:
        angles = headings(source["places"], source["template"], source["joints"], mask)
        source["places"] = rotated(source["places"], -angles)
    device = next(network.parameters()).device
    batch = source, target, RaggedTokens.between(source["joints"], target["joints"], mask)
    with torch.inference_mode():
        answer = network(*to_device(batch, device)).cpu().double().numpy()
    for piece, length, joints in zip(group, lengths, rotated(answer, angles), strict=True):
        question = piece.question
        joints = joints[:length, : len(question.body.joints)]
        yield joints[:, :1] / question.actor_size + (joints - joints[:, :1]) / question.body_size


def _joined(question: Question, answers: Sequence[tuple[Piece, np.ndarray]]) -> Positions:
    """The pieces faded into each other; then the path of the hips scaled (A.6)."""
    frames = len(question.positions)
    total, weight = np.zeros((frames, len(question.body.joints), 3)), np.zeros((frames, 1, 1))
    for piece, answer in answers:
        share = _fade(piece.stop - piece.start)[:, None, None]
        total[piece.start : piece.stop] += share * (answer + piece.centre)
        weight[piece.start : piece.stop] += share
    positions = (total / weight)[: question.frames]
    positions += (question.ratios - 1.0) * positions[:, :1]
    full_body = question.body.positions(positions, rates.FPS, rates.at_thirty(question.source))
    at_rate = rates.at(full_body, question.source.frames, question.source.fps)
    assert isinstance(at_rate, Positions)
    return at_rate


def _fade(frames: int) -> np.ndarray:
    """``(frames,)`` up to the middle and down again."""
    return np.minimum(np.arange(1, frames + 1), np.arange(frames, 0, -1)).astype(float)
