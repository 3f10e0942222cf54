"""The bones that carry a garment while it plays: rope chains, their correction, and bones carried by the body."""
