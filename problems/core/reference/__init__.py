"""The core in NumPy: it runs everywhere, and the compiled one is tested against it."""

from problems.core.reference.core import ReferenceCore

__all__ = ["ReferenceCore"]
