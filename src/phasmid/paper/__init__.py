"""The paper, reproduced and graded: its statements, its misprints, and what they cost."""
