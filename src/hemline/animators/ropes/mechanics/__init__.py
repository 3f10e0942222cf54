"""The mechanics of rope chains: one step of the paper's sections 3 to 6, without garment or body model."""
