"""What the fits of `lag` and `swingar` share: the conversion of takes to training frames, and the fit itself."""
