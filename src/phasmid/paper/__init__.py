"""Reproduction of the paper: grades of its statements, misprints and their cost."""
