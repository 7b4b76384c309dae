"""Layers of methods from joint positions and movements to rotations (NKN, PMnet).

``features.see`` gives poses as seen from where a body faces. ``SightRetargeter`` retargets them by networks
of structures: ``OneStructure`` for all bodies, or one of ``ManyStructures``. ``UnpairedTraining`` draws
batches.
"""
