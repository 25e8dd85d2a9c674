"""The pages of the service: what a result is worth, at a glance and in every detail."""
