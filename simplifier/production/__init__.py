"""What one run of a command makes, from the options that users choose to the report."""
