"""A metric of sets that does something wrong with the features of a case, or with a value of sets."""

import os
import time

import numpy as np

from retarget_bench.api import CaseFeatures, MetricCard, Value


def fail(*_):
    raise RuntimeError("odd sets")


DEEDS = {
    "fail": fail,
    "hang": lambda *_: time.sleep(60),
    "text": lambda *_: "0.5",
    "huge": lambda *_: 1e301,
    "exit": lambda *_: os._exit(5),
    "nan": lambda predicted, real, speed: CaseFeatures(predicted * np.nan, real, speed),
    "ragged": lambda predicted, real, speed: CaseFeatures(predicted, real[:1], speed),
    "wider": lambda predicted, real, speed: CaseFeatures(np.tile(predicted, 2), np.tile(real, 2), speed),
}


class SwaySets:
    """Parameters: what is done wrong with the ``features`` of one case, and with the ``value``."""

    card = MetricCard(
        name="sway_sets",
        summary="a toy",
        version="1",
        values=(Value("sway_gap", "gap", "distance of means", "m", "lower", "|m_r - m_g|", "here"),),
    )

    def __init__(self, features: str = "", value: str = "") -> None:
        self._features, self._value = DEEDS.get(features), DEEDS.get(value)

    def features(self, comparison):
        generated, real = (
            side[::4, 0].astype(np.float32) for side in (comparison.predicted, comparison.expected)
        )
        arguments = generated, real, np.linspace(0, 1, len(generated), dtype=np.float32)
        if self._features and comparison.case.info.id == "toy/small>tall/clip 0":
            return self._features(*arguments)
        return CaseFeatures(*arguments)

    def least(self, value_id):
        return 1

    def value(self, value_id, real, generated):
        if self._value:
            return self._value(value_id, real, generated)
        return float(np.linalg.norm(real.features.mean(axis=0) - generated.features.mean(axis=0)))


plugin = SwaySets
