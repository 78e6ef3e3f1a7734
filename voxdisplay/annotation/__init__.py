"""Annotation of captures: each packet and op in words, and every violation of protocol.md."""
