"""Feature networks for comparing sets of motions: what they see, how they are kept and trained."""
