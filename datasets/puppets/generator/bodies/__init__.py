"""Proportions, joint sets, characters, rigs and skins, of people and of dogs."""
