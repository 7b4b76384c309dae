"""Tables of results: one model, built from summaries, drawn by several renderers.

Imports analysis and results.
Offers the table model, its builder, published tables with our rows, and renderers.
"""
