"""Displays as users hold them: opening, sessions, frames on their way, and proof."""
