"""Displays as users hold them: opening, sessions, queued frames, reading back, waiting."""
