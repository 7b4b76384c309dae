"""Tables as papers printed them, and our own results put into the same places."""
