"""Training of learned methods: data, the loop, checkpoints, weights with their cards.

Imports evaluation, for validation.
Offers the training contract and loop, joint data sets, weights files, and layers.
"""
