"""Layers of methods with networks for every structure, on rotations of its edges (SAN, PAN).

A body is seen in the ``Layout`` of a structure, as ``Features`` of its edges. ``SkeletalMethod`` retargets
by ``StructureNetworks``, which ``SkeletalTraining`` trains.
"""
