"""The paper's network: attention over the graph of a garment."""
