"""What each vertex of a proxy is told in a frame."""
