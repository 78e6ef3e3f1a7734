"""Sinks: LED cubes that take lighting protocols, and answer nothing.

A sink has a `voxdisplay.sinks.led_sink.LedSink` behind an entry point of the group
``voxdisplay.sink``. Must not know frames, displays, or when a picture is due.
"""
