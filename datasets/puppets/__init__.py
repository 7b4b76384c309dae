"""Paired performances of generated bodies of five structures, with exact contacts: needs no download."""

from .corpus.dataset import Puppets as plugin

__all__ = ["plugin"]
