"""What a single convex occluder hides (Cohen-Or et al. 1998)."""
