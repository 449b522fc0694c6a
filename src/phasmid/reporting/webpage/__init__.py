"""The page of a run: one file with its replay, numbers and figures, which needs no network."""

from phasmid.reporting.webpage.document import DRAWING, content_policy, own_text, page_html

__all__ = ["DRAWING", "content_policy", "own_text", "page_html"]
