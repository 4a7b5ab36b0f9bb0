"""Sites in three dimensions."""
