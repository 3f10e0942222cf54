"""The step of rope chains in torch, to fit their constants by gradient."""
