"""Where rope chains run on a garment."""
