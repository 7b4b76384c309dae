"""From a plan to finished results: predicting, scoring, and the values of whole sets of answers.

Imports motion, plugins and results.
Offers plans and their units, the runner and its process pool, derived tasks, set metrics and timing.
"""
