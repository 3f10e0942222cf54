"""What ships as files, and (`make`) the commands that made them. `README.md` lists both."""
