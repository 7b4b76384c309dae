"""Results as one page that opens from disk: tables, charts, and the motion behind every number."""
