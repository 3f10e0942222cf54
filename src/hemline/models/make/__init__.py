"""Commands that make the shipped files, one module each, such as `python -m hemline.models.make.excerpts FOLDER`."""
