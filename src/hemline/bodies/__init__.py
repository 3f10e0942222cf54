"""Body models: shape and pose to joints, skin and mesh."""
