"""Contact that remembers on which skin a vertex lay."""
