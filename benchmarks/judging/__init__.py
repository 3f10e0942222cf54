"""What `judges.py` is made of."""
