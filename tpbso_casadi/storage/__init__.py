"""Files of a run: run folders, exports, and how they are read and audited."""
