"""The lag network: a small network on what each vertex is told."""
