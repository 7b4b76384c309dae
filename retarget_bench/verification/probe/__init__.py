"""Probes of ``bench test --probes``: questions rewritten so that the change of the answer is known."""
