"""Pictures of errors, and the summary of all experiments."""
