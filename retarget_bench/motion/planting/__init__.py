"""Feet that stay where they are planted: limbs that reach in closed form, contacts, eased corrections."""
