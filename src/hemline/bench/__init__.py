"""What ships, timed on the machine at hand: `hemline bench`."""
