"""Shows: moving pictures as frames by number, playlists of them, and when each frame is due.

Must not know displays, links or clocks.
"""
