"""Foundations: matrices, symbolic or numeric; arguments of compiled code; the error for impossible statements."""
