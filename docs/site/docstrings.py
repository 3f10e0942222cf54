"""What griffe is told: our docstrings say `Example:` where its parser knows `Examples:`."""

import re

import griffe


class SingleExample(griffe.Extension):
    """Examples are set as code."""

    def on_object(self, *, obj: griffe.Object, **_) -> None:
        """Rename the section of each docstring."""
        if obj.docstring is not None:
            obj.docstring.value = re.sub(r"^(\s*)Example:$", r"\1Examples:", obj.docstring.value, flags=re.MULTILINE)
