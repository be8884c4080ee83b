"""The figures of a comparison. Imported only where a figure is drawn: matplotlib is slow to load."""
