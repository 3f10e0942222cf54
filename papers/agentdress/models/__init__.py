"""Models that the experiments compare with AgentDress: parts removed or exchanged, DRAPE, and simple baselines."""
