"""Training needs PyTorch: its tests run where their folder is named."""

collect_ignore = ["training"]
