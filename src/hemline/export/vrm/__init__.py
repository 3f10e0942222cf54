"""VRM 1.0 avatars with spring bones."""
