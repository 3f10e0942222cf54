"""glTF 2.0 in one binary file."""
