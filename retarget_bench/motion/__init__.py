"""Skeletons, characters and motions: reading and writing files, roles, kinematics, fitting, transfer.

Imports errors and files; nothing of the benchmark.
Offers ``Character``, ``Motion``, ``Positions``, ``bvh``, ``importer``, ``fitting`` and ``rotation``.
"""
