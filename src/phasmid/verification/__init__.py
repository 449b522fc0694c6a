"""The physics against closed forms: rows that a user can run."""
