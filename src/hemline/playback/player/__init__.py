"""One garment on one body, frame by frame."""
