"""Garments from files: meshes with or without a TOML file, and MakeHuman's clothes."""
