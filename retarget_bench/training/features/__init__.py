"""Feature networks for comparing sets of motions: input, storage and training."""
