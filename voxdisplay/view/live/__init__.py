"""The front page of a display, live in a browser.

A source (`sources`) brings what *is* on display, a message (`message`) carries it, a server
(`server`) hands the newest one to every browser that has room for it, and one page (``page.html``)
draws it. Nothing of this knows what a host meant to show.
"""
