"""The page of a run: one file with its replay, numbers and figures, which needs no network."""

from phasmid.reporting.webpage.document import DRAWING, Page, Picture, own_text

__all__ = ["DRAWING", "Page", "Picture", "own_text"]
