"""Web pages that play models without a server: one `.html`, or a folder for a static host. See `README.md`."""

from .contents import page_contents as page_contents
from .demo_page import write_demo_page as write_demo_page
from .write import check_page as check_page
from .write import write_page as write_page

__all__ = ["check_page", "page_contents", "write_demo_page", "write_page"]
