"""Data of all charts, computed once from results, for files and pages alike."""
