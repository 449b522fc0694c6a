"""The studies of docs/control.md: the locomotion engine measured, each study in a file.

A study has ``cases``, which returns its runs; ``measure``, which runs one of them and returns its
numbers; and ``table``, which returns their table as text. `study.run` runs cases side by side.
"""
