"""Commands that make the shipped files, one each: `python -m hemline.models.make.excerpts FOLDER` and its sisters."""
