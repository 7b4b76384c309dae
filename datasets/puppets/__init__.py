"""Paired performances of generated bodies of five structures, with exact contacts: needs no download."""

from .dataset import Puppets as plugin

__all__ = ["plugin"]
