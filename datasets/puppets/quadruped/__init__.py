"""Dogs: bodies, scores, solver and performances of four-legged puppets."""
