"""What learned methods share: motion to train on, the loop, checkpoints, and weights with their cards."""
