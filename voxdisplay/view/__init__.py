"""Rendering of a display's page: to files, notebooks, the terminal and the browser.

Everything starts from a page, the array of a display's memory, so that a page that was read back
from a device is drawn like one that a host is about to send. Knows grids and pixel formats; knows
no curve, scene, packet or port. Nothing here is imported before a picture is asked for; all but
`camera` and `lit_voxels` needs the extra ``view``.
"""
