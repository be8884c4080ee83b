"""What the functions of the package return: they print themselves in a line, and show themselves in a notebook."""
