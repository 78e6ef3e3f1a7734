"""Import of Pillow, with an error that says how to install it."""

from voxdisplay.errors import MissingExtra

try:
    from PIL import Image, ImageChops, ImageDraw, ImageFont, ImageShow
except ModuleNotFoundError as error:
    raise MissingExtra(
        "pictures need Pillow, which is not installed", hint="pip install 'voxdisplay[view]'"
    ) from error

__all__ = ["Image", "ImageChops", "ImageDraw", "ImageFont", "ImageShow"]
