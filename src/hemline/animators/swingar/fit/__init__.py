"""The training of the graph network."""
