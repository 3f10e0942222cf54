"""Contact that remembers which part of the skin kept each cloth vertex outside the body."""
