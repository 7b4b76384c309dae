"""The commands of ``bench``, one module each; every module has a ``command``."""
