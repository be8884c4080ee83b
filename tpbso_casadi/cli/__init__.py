"""The command lines: options, messages, exit statuses."""
