"""Plug-ins by name, and the parameters that are written after them: ``name[parameter=value]+post``.

Imports motion and the contracts of ``api``; nothing that evaluates.
Offers the registry, ``Spec``, parameter fitting, suite files and the composition of post-processors.
"""
