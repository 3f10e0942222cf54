"""Packs of compiled kernels, which `hemline.compiled.pack` reads."""
