"""The features that a network is given of a garment and its motion."""
