"""Contact of cloth vertices with the skin of the body."""
