"""The bones that carry a garment while it plays: rope chains, learned bones, and bones carried by the body."""
