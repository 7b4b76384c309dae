"""A plug-in package as a third party would write it."""
