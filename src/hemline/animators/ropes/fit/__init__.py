"""The fit of rope chains: from simulated takes to a model file."""
