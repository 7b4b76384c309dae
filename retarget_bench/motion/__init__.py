"""Skeletons, characters and motions: reading and writing BVH, roles, kinematics, fitting, transfer.

Imports errors and files; nothing of the benchmark.
Offers ``Character``, ``Motion``, ``Positions``, ``bvh``, ``importer``, ``fitting`` and ``rotation``.
"""
