"""Feed-forward torques of the commanded motion within friction and servo limits."""
