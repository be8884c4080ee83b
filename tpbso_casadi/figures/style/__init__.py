"""What all figures share: colours and line styles, and how they are written."""
