"""Live page: a robot in physics, watched and driven from a browser."""
