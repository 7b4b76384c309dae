"""Showing motion: scenes of cases and files, drawn as pictures, packed for pages, or served live.

Imports evaluation, analysis and figures.
Offers scenes, their drawing and packing, the player of pages, and the live view.
"""
