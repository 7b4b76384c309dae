"""The commands of ``bench``, one module each; every module has a ``command``.

Imports everything, but only inside the functions that need it, so that help stays fast.
Offers nothing to other packages.
"""
