"""Published tables of papers, with our own results in their columns."""
