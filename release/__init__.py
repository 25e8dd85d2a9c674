"""What is handed out: ``python -m release.wheel``."""
