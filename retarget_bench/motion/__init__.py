"""What moves: skeletons, characters, motions, and how files become them."""
