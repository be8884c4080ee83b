"""What a user states: scenario files, checked key by key, and the built-in ones."""
