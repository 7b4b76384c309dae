"""glTF 2.0 and GLB files, read and written with JSON and NumPy alone."""
