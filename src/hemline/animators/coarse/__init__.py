"""Animates a garment by a network that moves a coarse proxy of it: what `lag` and `swingar` share."""
