"""Who performs what: lists of clips and cases, training and test parts."""
