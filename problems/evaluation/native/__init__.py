"""Programs as compiled code: written in C++, compiled, kept and loaded."""
