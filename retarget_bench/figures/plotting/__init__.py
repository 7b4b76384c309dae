"""Charts as files, drawn by matplotlib without a display."""
