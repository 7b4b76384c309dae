"""Charts as inline SVG, for pages: every mark has words, and leads to the cases behind it."""
