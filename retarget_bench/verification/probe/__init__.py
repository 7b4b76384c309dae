"""What ``bench probe`` asks: questions written differently, whose answers must not change, or change so."""
