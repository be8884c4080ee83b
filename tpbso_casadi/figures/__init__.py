"""Pictures of a plan. Imported only where a figure is drawn: matplotlib is slow to load."""
