"""Networks while they are trained, with torch."""
