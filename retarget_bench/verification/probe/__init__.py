"""Questions of ``bench probe``, rewritten so that the change of the answer is known."""
