"""The training of SwinGar's network."""
