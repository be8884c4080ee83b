"""Arguments of a call: objects as tables of a scenario, errors in words of Python."""
