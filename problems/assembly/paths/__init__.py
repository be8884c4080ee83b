"""Problems of leading a tool along a path at free times."""
