"""Motions to be looked at: what is shown, and how it is packed, drawn and served.

Imports results, evaluation, motion, and of figures the palette and the method order.
Offers scenes, pictures and clips of them, the player of pages and a live view.
"""
