"""Contact with a memory of the skin that held each vertex off."""
