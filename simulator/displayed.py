"""What makes an object one that notebooks show as a picture and tables."""

import importlib


class Displayed:
    """An object that notebooks show by `simulator.displays`.

    That room stands above those of the objects, so it is imported by its name when one is shown.
    """

    def _repr_html_(self) -> str:
        return importlib.import_module("simulator.displays").display_html(self)
