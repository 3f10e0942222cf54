"""The figures of Jin et al. 2024, a file each; `figures.py` beside this folder draws them."""
