"""What is left on the disk: run folders, exports, and how they are read again."""
