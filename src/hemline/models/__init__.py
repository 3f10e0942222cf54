"""Files that ship with hemline, and in `make` the commands that made them; `README.md` lists both."""
