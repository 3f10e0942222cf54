"""The features of a garment and its motion that a network is given."""
