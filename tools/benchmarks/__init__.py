"""Tables of ``tools/bench.py``, one module each."""
