"""Acclaim skeletons (ASF) and their motions (AMC)."""
