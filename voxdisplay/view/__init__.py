"""Pictures of what a display shows: files, terminal, browser.

All of it starts from a page, the array that a display's memory is, so that what was read back from
a device is drawn like what a host means to send. It knows grids and pixel formats, and neither
curves, scenes, packets nor ports. Nothing here is imported until a picture is asked for; all but
`camera` and `voxels` needs the extra ``view``.
"""
