"""Distributed training in the processes that ``torchrun`` starts; none of it applies to one process.

Training modules may count on this: parameters and buffers are the same in every process. Gradients are
averaged by torch's DistributedDataParallel; after every step all processes take the first one's buffers.
"""

import json
import os
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import timedelta
from pathlib import Path
from typing import TypeVar

import torch
import torch.distributed as dist
from torch import Tensor, nn
from torch.distributed.rendezvous import rendezvous

from retarget_bench.errors import BenchError

T = TypeVar("T")

PATIENCE = timedelta(hours=6)
"""The time that processes wait for one that makes data or validates; a dead one is noticed at once."""


def world() -> int:
    """Number of processes that train together, from ``torchrun``'s environment."""
    return int(os.environ.get("WORLD_SIZE", "1")) if "RANK" in os.environ else 1


def rank() -> int:
    """The number of this process; only the first, 0, writes."""
    return int(os.environ.get("RANK", "0"))


def restarted() -> bool:
    """True if ``torchrun`` started the processes anew because one had died."""
    return int(os.environ.get("TORCHELASTIC_RESTART_COUNT", "0")) > 0


def job() -> str:
    """A name shared by all processes that one ``torchrun`` starts and starts again; "" without it."""
    name = os.environ.get("TORCHELASTIC_RUN_ID")
    return f"{name} {os.getppid()}" if name else ""


def record(error: BenchError) -> None:
    """Leave the sentence where ``torchrun`` looks for it: it ends its own report, whatever it prints above.

    The report shows ``message`` of https://pytorch.org/docs/stable/elastic/errors.html where there is no
    call stack.
    """
    if path := os.environ.get("TORCHELASTIC_ERROR_FILE"):
        report = {"message": f"bench: {error}", "extraInfo": {"timestamp": str(int(time.time()))}}
        with suppress(OSError):  # the sentence is printed all the same
            Path(path).write_text(json.dumps({"message": report}), encoding="utf-8")


def device(name: str) -> torch.device:
    """``cpu``, ``cuda`` or ``auto`` as the device of this process. Raises BenchError."""
    if name == "cpu" or (name == "auto" and not torch.cuda.is_available()):
        return torch.device("cpu")
    if not torch.cuda.is_available():
        raise BenchError("torch finds no CUDA device here; train with --device cpu")
    number = int(os.environ.get("LOCAL_RANK", "0"))
    if number >= torch.cuda.device_count():
        raise BenchError(
            f"there are {torch.cuda.device_count()} CUDA devices and more processes on this machine; "
            "start one process per device"
        )
    return torch.device("cuda", number)


def join(where: torch.device) -> None:
    """Meet the other processes, where there are any. Plain data travel by gloo, gradients as they are."""
    if world() == 1 or dist.is_initialized():
        return
    if where.type == "cuda":
        torch.cuda.set_device(where)
    backend = "cpu:gloo,cuda:nccl" if where.type == "cuda" else "gloo"
    store, number, count = next(rendezvous("env://", timeout=PATIENCE))
    # a store that outlives a restart still has the addresses of processes that are gone
    attempt = os.environ.get("TORCHELASTIC_RESTART_COUNT", "0")
    store = dist.PrefixStore(f"attempt {attempt}", store)  # type: ignore[attr-defined]
    dist.init_process_group(backend, store=store, rank=number, world_size=count, timeout=PATIENCE)


def leave() -> None:
    """The end of ``join``."""
    if dist.is_available() and dist.is_initialized():
        dist.destroy_process_group()


def _together() -> bool:
    return dist.is_available() and dist.is_initialized()


def mean(tensor: Tensor) -> Tensor:
    """The mean over all processes of a tensor that each has; the tensor itself with one process."""
    if not _together():
        return tensor
    total = tensor.detach().clone()
    dist.all_reduce(total)
    return total / dist.get_world_size()


def first(call: Callable[[], T]) -> T:
    """The result of the first process's call, for all of them; a BenchError of it is raised in all."""
    if not _together():
        return call()
    box: list[T | BenchError] = [None]  # type: ignore[list-item]
    if dist.get_rank() == 0:
        try:
            box = [call()]
        except BenchError as error:
            box = [error]
    dist.broadcast_object_list(box, src=0, device=torch.device("cpu"))
    if isinstance(box[0], BenchError):
        raise box[0]
    return box[0]


def in_turn(call: Callable[[], T]) -> T:
    """Called by the first process, then by the others: they find in caches what it has made."""
    if not _together():
        return call()
    answers: list[T] = []
    first(lambda: answers.append(call()))
    return answers[0] if answers else call()


def share_state(module: nn.Module, *, buffers_only: bool = False) -> None:
    """Make the first process's parameters and buffers everybody's."""
    if not _together():
        return
    tensors = list(module.buffers())
    if not buffers_only:
        tensors += [parameter.data for parameter in module.parameters()]
    for tensor in tensors:
        contiguous = tensor.contiguous()
        # gloo sends no truth values
        dist.broadcast(
            contiguous.view(torch.uint8) if contiguous.dtype == torch.bool else contiguous, src=0
        )
        if contiguous is not tensor:
            tensor.copy_(contiguous)
