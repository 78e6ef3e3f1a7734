"""Live view of a display's front page in a browser.

A source (`sources`) reads what is on display, a message (`message`) carries it, a server
(`server`) sends the newest one to every browser that is ready for it, and one page (``browser/``)
renders it. Knows nothing of what a host meant to show.
"""
