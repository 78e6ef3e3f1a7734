"""Emulator of a volumetric display, written from the protocol document alone.

It shares no code with the host driver, so that a round trip through both proves something.
"""
