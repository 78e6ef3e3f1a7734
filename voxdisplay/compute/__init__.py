"""Execution of array work: numpy or compiled kernels, one processor or all. Knows no geometry."""
