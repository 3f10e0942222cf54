"""A coarse copy of a garment that a network moves, and the garment that rides on it: what `lag` and `swingar` share."""
