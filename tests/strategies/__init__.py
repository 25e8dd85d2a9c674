"""What hypothesis draws: meshes and options of every kind, for property tests and the fuzzer."""
