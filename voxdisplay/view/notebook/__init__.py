"""Views of pages in cells of notebooks: widgets around the page of the live view.

A cell holds the page in a frame of its own, so that many views in one notebook do not disturb each
other or the notebook. Beside the widget a PNG is saved. Knows snapshots and sources of them; knows
no display. Nothing here is imported before a view is asked for; it needs the extra ``notebook``.
"""
