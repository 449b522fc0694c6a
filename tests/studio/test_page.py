"""The live page's files: whole, told by a fixed table, and with nothing that its policy forbids."""

import re

import pytest

from phasmid.studio.server import page_files


@pytest.fixture(scope="module")
def page():
    return page_files()["studio.html"]


def test_what_the_page_names_is_in_the_table_and_the_table_holds_nothing_else(page):
    named = set(re.findall(r'(?:src|href)="/assets/([^"]+)"', page))
    assert named | {"studio.html"} == set(page_files())


def test_the_page_holds_no_script_style_or_address_of_its_own(page):
    # Its policy would refuse them: script-src 'self', style-src 'self', and nothing from elsewhere.
    assert all(tag.startswith("<script defer src=") for tag in re.findall(r"<script[^>]*>", page))
    assert not re.search(r"<style|\sstyle=|\son[a-z]+=|https?:|//", page)


def test_its_scripts_never_read_text_as_a_page():
    # Names come from files of strangers (W11); they are set as text, which nothing can run.
    forbidden = r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function"
    for name, text in page_files().items():
        assert not re.search(forbidden, text), name
