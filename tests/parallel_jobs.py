"""Functions for test_parallel.py; a module so that processes can import it."""

import os
import signal
import time


def square(number):
    return number**2


def trouble(what):
    if what == "raise":
        raise ValueError("seven")
    if what == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    if what == "exit":
        os._exit(3)
    if what == "threads":
        return os.environ["OMP_NUM_THREADS"]
    if what == "torch":
        import torch

        return torch.get_num_threads(), torch.randn(400, 400).mm(torch.randn(400, 400)).shape[0]
    return os.getpid()


def nap(seconds):
    time.sleep(seconds)
    return os.getpid()
