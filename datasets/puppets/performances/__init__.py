"""Performances: what is done, as scores that fit every body; ``people`` and ``dogs`` hold the kinds.

May import the root's helpers and the engine, but no body. Offers ``Score`` and both ``KINDS``."""
