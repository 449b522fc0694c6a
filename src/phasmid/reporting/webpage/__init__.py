"""The page of a run: one file with its replay, numbers and figures, which needs no network."""

from phasmid.reporting.webpage.document import Picture, web_page

__all__ = ["Picture", "web_page"]
