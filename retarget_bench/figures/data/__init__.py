"""What every kind of chart shows, computed once from results, for files and for pages alike."""
