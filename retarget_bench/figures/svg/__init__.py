"""Charts as inline SVG for pages, each mark with words and a link to its cases."""
