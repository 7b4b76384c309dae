"""From joint positions to rotations: the motion of a body that comes nearest to positions of its joints."""
