"""What is done, as scores that fit every body."""
