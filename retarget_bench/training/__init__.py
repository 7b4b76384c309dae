"""Training of learned methods: data, the loop, checkpoints, weights with their cards.

Imports evaluation, for validation, and tables, for ablations.
Offers the training contract and loop, joint data sets, weights files, layers and feature networks.
"""
