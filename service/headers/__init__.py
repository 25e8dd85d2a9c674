"""Headers, each as its standard has it: text in, values out."""
