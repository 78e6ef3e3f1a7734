"""Emulator of a volumetric display, written from protocol.md alone.

It shares no code with the host driver: a round trip through both compares two independent
implementations.
"""
