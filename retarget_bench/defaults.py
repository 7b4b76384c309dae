"""What is used when nothing is said. The only place where the engine names plug-ins."""

DATASET = "puppets[size=tiny]"
METHOD = "ik"
