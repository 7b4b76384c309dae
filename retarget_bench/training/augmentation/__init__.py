"""Augmentation: other motion made of the windows that a batch draws.

Changes are made to motion, not to what a method sees of it: a changed window goes through the method's own
``prepare``, so whatever that gives (paths, velocities, contacts) fits the changed motion.
"""
