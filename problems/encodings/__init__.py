"""From a search vector to a motion and back to one number: decision variables and penalties."""
