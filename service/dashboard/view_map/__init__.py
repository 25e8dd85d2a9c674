"""How good an occluder is by direction: a sphere of views, unrolled."""
