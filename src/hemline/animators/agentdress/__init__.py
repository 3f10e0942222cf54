"""AgentDress: garments that fit closely, on bodies of any shape, from a small database of settled garments."""
