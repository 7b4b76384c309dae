"""Acclaim files: a skeleton (ASF) and its motions (AMC)."""
