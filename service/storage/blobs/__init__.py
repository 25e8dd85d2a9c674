"""Bytes by their SHA-256, in files."""
