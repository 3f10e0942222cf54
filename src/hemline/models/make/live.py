"""Make the model that nothing is fitted for: `python -m hemline.models.make.live`. It holds the options of `live`."""

from hemline.animators.live import Live
from hemline.animators.model_file import SHIPPED_FOLDER

from .terms import main as write_terms

if __name__ == "__main__":
    Live().save(SHIPPED_FOLDER / "live.safetensors")
    write_terms()
