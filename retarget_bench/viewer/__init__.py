"""Motions to be looked at: what is shown, and how it is packed, drawn and served."""
