"""Wire format of protocol.md: packets and ops as values and bytes.

Must not know I/O, clocks or frames in flight.
"""
