"""A second simulator: the trunk in free motion, its joints prescribed, and any law of contact."""
