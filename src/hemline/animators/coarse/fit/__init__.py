"""What the fits of `lag` and `swingar` share: takes as frames to learn from, and the fit itself."""
