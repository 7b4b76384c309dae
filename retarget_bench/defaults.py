"""What is used when nothing is said. The only place where the engine names a plug-in."""

DATASET = "puppets[size=tiny]"
