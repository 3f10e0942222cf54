"""The fit of AgentDress: from settled garments to a model file."""
