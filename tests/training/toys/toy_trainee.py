"""A linear map of root paths, trained to change nothing, with a discriminator that trains in odd steps.

does: ``nan``: a loss is not a number in step 13; ``kill``: the process of rank 1 dies in step 23, unless it
was started again; ``pick``: takes ``tall`` alone. pause: seconds that every step sleeps.
With TOY_DUMP, a folder, every process notes there the weights that each of its steps begins with.
Its batches, dropout, a history in a buffer and a running score make every step depend on all before it.
"""

import json
import math
import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path

import torch
from torch import nn

from retarget_bench.api import MethodCard
from retarget_bench.errors import BenchError, NotSupported
from retarget_bench.training import parallel
from retarget_bench.training.config import TrainingConfig
from retarget_bench.training.contract import Phase
from retarget_bench.training.learned_method import LearnedMethod


class ToyLearner:
    phases = (
        Phase("generator", ("map",), clip=1.0),
        Phase("critic", ("critic",), rate=0.5, betas=(0.5, 0.999)),
    )

    def __init__(self, trainee, training_data, config):
        self.trainee, self.training_data, self.config = trainee, training_data, config
        critic = nn.Linear(3, 1)
        critic.register_buffer("history", torch.zeros(8, 3))
        critic.register_buffer("score", torch.zeros(()))
        critic.register_buffer("high", torch.zeros(3, dtype=torch.bool))
        critic.register_buffer("steps", torch.zeros((), dtype=torch.int64))
        self.modules = nn.ModuleDict({"map": nn.Linear(3, 3), "critic": critic, "noise": nn.Dropout(0.1)})

    def draw(self, numbers, rows):
        cut = self.training_data.draw(numbers, self.training_data.cast(numbers, rows), self.config.window)
        return {"root": cut.arrays["root"], "more": {"lengths": cut.lengths}}

    def losses(self, phase, batch, memory):
        return getattr(self, f"_{phase}")(batch["root"], memory)

    def _generator(self, root, memory):
        critic = self.modules["critic"]
        self._note(int(critic.steps))
        critic.steps += 1
        self._misbehave(int(critic.steps))
        generated = self.modules["map"](self.modules["noise"](root))
        memory["made"] = generated.detach()
        fooled = 0.01 * (critic(generated) - critic.score).square().mean()
        wrong = (generated - root).square().mean()
        return {"rebuilt": wrong * (math.nan if self._is("nan", 13) else 1.0), "fooled": fooled}

    def _critic(self, root, memory):
        critic = self.modules["critic"]
        if int(critic.steps) % 2:
            return {}
        critic.history.copy_(torch.cat([critic.history[1:], memory["made"].mean(dim=(0, 1))[None]]))
        critic.high.copy_(memory["made"][0, 0] > memory["made"][0, 1])
        critic.score.copy_(parallel.mean(critic(root).detach().mean()))
        return {"told": (critic(root) - 1).square().mean() + critic(critic.history).square().mean()}

    def _note(self, step):
        if folder := os.environ.get("TOY_DUMP"):
            weights = [float(x) for p in self._tensors() for x in p.detach().flatten()]
            with (Path(folder) / f"rank-{parallel.rank()}.jsonl").open("a") as file:
                file.write(json.dumps([step, *weights]) + "\n")

    def _tensors(self):
        return [*self.modules.parameters(), *self.modules.buffers()]

    def _is(self, what, step):
        return self.trainee.config.does == what and int(self.modules["critic"].steps) == step

    def _misbehave(self, step):
        time.sleep(self.trainee.config.pause)
        if self._is("kill", 23) and parallel.rank() == 1 and not parallel.restarted():
            os.kill(os.getpid(), signal.SIGKILL)

    def method(self):
        return ToyTrainee().using(self.export())

    def export(self):
        return self.modules["map"].state_dict()

    def load(self, tensors):
        try:
            self.modules["map"].load_state_dict(dict(tensors))
        except RuntimeError as error:
            raise BenchError(f"these weights do not fit: {error}") from error


@dataclass(frozen=True)
class Config:
    does: str = ""
    """what it does wrong"""
    pause: float = 0.0
    """seconds of a step"""
    weights: str = "none"
    """a path"""


class ToyTrainee(LearnedMethod):
    Config = Config
    card = MethodCard(name="toy_trainee", summary="toy", version="1", default=False)
    presets = {  # noqa: RUF012
        "default": TrainingConfig(
            steps=40, batch=8, window=16, rate=0.05, schedule="cosine", warm_up=5, validate=15, cases=3
        ),
        "quick": TrainingConfig(steps=10, batch=4, window=8, rate=0.05, validate=5, cases=2),
        "wild": TrainingConfig(steps=10, batch=3, window=8, rate=0.05),
    }

    def facts(self):
        return {"kind": "linear"}

    def unfit(self, character):
        picky = self.config.does == "pick" and character.name != "tall"
        return f"{character.name} is not tall" if picky else ""

    def prepare(self, motion):
        return {"root": motion.root}

    def training_module(self, training_data, config):
        if len(training_data.clips) < 2:
            raise NotSupported("toy_trainee needs motion of two characters")
        return ToyLearner(self, training_data, config)

    def supports(self, source, target):
        return "not to myself" if source.name == target.name else None

    def retarget(self, source, target, *, context):
        root = torch.from_numpy(source.root).float()
        moved = nn.functional.linear(root, self.tensors["weight"], self.tensors["bias"])
        return target.motion(source.rotations, moved.double().numpy(), source.fps)


plugin = ToyTrainee
