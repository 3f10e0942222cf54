"""Sources of frames, the stage that steps them, and measures of a frame. Nothing here knows a browser."""
