"""Bodies: proportions, joint sets, characters, rigs and skins, of people and of dogs.

May import the root's helpers and the engine. Offers ``characters``, ``dogs`` and ``rigs``."""
