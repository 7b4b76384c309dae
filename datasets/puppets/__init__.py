"""Paired performances of six generated bodies, with exact contacts: needs no download."""

from .corpus import Puppets as plugin

__all__ = ["plugin"]
