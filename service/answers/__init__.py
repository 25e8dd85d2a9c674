"""What requests are answered with: results, files, refusals, in the format that is asked for."""
