"""FBX files, binary and ASCII, read through ufbx in a process of its own."""
