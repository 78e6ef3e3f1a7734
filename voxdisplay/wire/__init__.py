"""The wire: packets and ops as values and bytes. No I/O, no clock, no frames in flight."""
