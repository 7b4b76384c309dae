"""The solver: a score performed by a body, by inverse kinematics in closed form over all frames at once.

May import bodies and performances. Offers ``people.solve``, ``dogs.solve`` and ``reach``."""
