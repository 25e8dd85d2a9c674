"""What a run will need of the machine's memory, told before it begins."""
