"""A score performed by a body: inverse kinematics in closed form, over all frames at once."""
