"""What the command lines show in the terminal: tables and progress."""
