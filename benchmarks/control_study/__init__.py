"""The studies of docs/control.md: the locomotion engine measured, each study in a file.

A study has ``cases``, which tells what is run; ``measure``, which runs one of them and tells its
numbers; and ``table``, which makes rows of text of them all. `study.run` runs cases side by side.
"""
