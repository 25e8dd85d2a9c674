"""Submitting: files, settings by the tables of the command line, and what comes of them.

The browser sends files straight to the API, so that they pass through no page's connection and may
be as large as the service allows.
"""
