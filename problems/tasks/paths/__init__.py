"""Statements about paths: of the tool, to follow or to trace, and of the joints."""
