"""Questions of ``bench test --probes``, rewritten so that the change of the answer is known."""
