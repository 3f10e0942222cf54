"""The training of the lag network."""
