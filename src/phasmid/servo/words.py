"""A servo's name in sentences. The servo of an imported robot has none."""

UNNAMED = "as in the file"
"""Name of a servo whose numbers are those of a robot file of another program."""


def servo_label(name: str) -> str:
    """Return the name, or "servo in the file"; "the" may precede both."""
    return "servo in the file" if name == UNNAMED else name


def servo_words(name: str) -> str:
    """Return "servo AX-12A", or "servo in the file"; "the" may precede both."""
    return "servo in the file" if name == UNNAMED else f"servo {name}"


def servo_quantity(name: str, quantity: str) -> str:
    """Return a quantity of a servo, "AX-12A's stall torque" or "stall torque in the file"."""
    return f"{quantity} in the file" if name == UNNAMED else f"{name}'s {quantity}"
