"""Tables of results: one model, built from summaries, drawn by several renderers.

Imports evaluation, for tasks and values of sets, results and analysis.
Offers the table model, its builder, published tables with our rows, and renderers.
"""
